#include "scheduler/farm/store_users.h"

#include <unistd.h>

#include <array>

#include "schema/base/json.h"

namespace vantage {
namespace fs = std::filesystem;

void note_store_user(const fs::path& store, const std::string& farm_id, const fs::path& state_dir) {
  const fs::path file = store / ".farms" / (farm_id + ".json");
  std::array<char, 256> host{};
  gethostname(host.data(), host.size() - 1);
  const Json user{{"farm_id", farm_id}, {"host", host.data()}, {"state_dir", state_dir.string()}};
  if (fs::exists(file) && read_json(file) == user) return;
  fs::create_directories(file.parent_path());
  write_json(file, user);
}

std::vector<StoreUser> store_users(const fs::path& store) {
  std::vector<StoreUser> users;
  if (!fs::is_directory(store / ".farms")) return users;
  for (const auto& entry : fs::directory_iterator(store / ".farms")) {
    if (entry.path().extension() != ".json") continue;
    const Json user = read_json(entry.path());
    users.push_back({user.at("farm_id"), user.at("host"), fs::path(user.at("state_dir").get<std::string>())});
  }
  return users;
}

}  // namespace vantage

#pragma once
/// STORE/.farms/<farm id>.json: which farms have shots in a store, so that who cleans it up asks them all.
#include <filesystem>
#include <string>
#include <vector>

namespace vantage {

struct StoreUser {
  std::string farm_id;
  std::string host;
  std::filesystem::path state_dir;
};

/// Notes that the farm uses the store; nothing when it stands there already.
void note_store_user(const std::filesystem::path& store, const std::string& farm_id,
                     const std::filesystem::path& state_dir);
std::vector<StoreUser> store_users(const std::filesystem::path& store);

}  // namespace vantage

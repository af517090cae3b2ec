#include "scheduler/cli/order_output.h"

#include <fmt/format.h>

#include <string>

namespace vantage {

void print_order_result(const Json& answer, bool dry_run, bool json) {
  if (json) {
    fmt::print("{}\n", answer.dump());
    return;
  }
  fmt::print("{}\n", answer.at("text").get<std::string>());
  if (!dry_run) return;
  for (const auto& name : answer.at("affected")) fmt::print("  {}\n", name.get<std::string>());
  const auto num_named = static_cast<int>(answer.at("affected").size());
  if (const int num = answer.at("num_changed"); num > num_named) fmt::print("  … and {} more\n", num - num_named);
}

}  // namespace vantage

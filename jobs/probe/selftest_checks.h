#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace vantage {

/// One thing that a machine must be able to do. run throws what is wrong; folder: private, for files.
struct MachineCheck {
  const char* name;
  void (*run)(const std::filesystem::path& folder);
  std::vector<std::string> for_kinds;  ///< only for machines that offer one of these; empty: for all
};

/// Known work with known results: no input is needed.
const std::vector<MachineCheck>& machine_checks();

/// Writes, syncs, reads back and renames in the store, in a folder that is gone afterwards.
void check_disk(const std::filesystem::path& store);

}  // namespace vantage

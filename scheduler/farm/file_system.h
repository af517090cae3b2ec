#pragma once
#include <filesystem>
#include <string>

namespace vantage {

/// What a folder lies on, by statfs: "ext4", "xfs", "nfs", "cifs", "fuse", …; "0x…" when the number has no name here.
/// Throws Error(BadInput) when it cannot be asked.
std::string file_system_of(const std::filesystem::path& folder);

/// SQLite's locks and its journal's shared memory do not hold there. A store may lie on such a file system, a farm's
/// database may not.
bool is_bad_for_a_database(const std::string& file_system);

/// Throws Error(BadInput) when the state folder lies on such a file system.
void refuse_network_database(const std::filesystem::path& state_dir);

}  // namespace vantage

#include "scheduler/farm/file_system.h"

#include <fmt/format.h>
#include <sys/vfs.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include "schema/base/error.h"

namespace vantage {
namespace {

/// man 2 statfs, linux/magic.h
struct Known {
  unsigned long number;
  const char* name;
};
constexpr std::array<Known, 14> kKnown = {{{0xEF53, "ext4"},
                                           {0x58465342, "xfs"},
                                           {0x9123683E, "btrfs"},
                                           {0x2FC12FC1, "zfs"},
                                           {0x01021994, "tmpfs"},
                                           {0x794C7630, "overlay"},
                                           {0x4D44, "fat"},
                                           {0x6969, "nfs"},
                                           {0xFF534D42, "cifs"},
                                           {0x517B, "smb"},
                                           {0xFE534D42, "smb2"},
                                           {0x65735546, "fuse"},
                                           {0x01021997, "9p"},
                                           {0xC36400, "ceph"}}};

}  // namespace

std::string file_system_of(const std::filesystem::path& folder) {
  struct statfs info {};
  if (statfs(folder.c_str(), &info) != 0)
    throw Error(ErrorKind::BadInput, fmt::format("{}: {}", folder.string(), std::strerror(errno)));
  const auto number = static_cast<unsigned long>(info.f_type) & 0xFFFFFFFFUL;
  const auto* found = std::find_if(kKnown.begin(), kKnown.end(), [&](const Known& k) { return k.number == number; });
  return found != kKnown.end() ? found->name : fmt::format("{:#x}", number);
}

bool is_bad_for_a_database(const std::string& file_system) {
  for (const char* name : {"nfs", "cifs", "smb", "smb2", "fuse", "9p", "ceph"})
    if (file_system == name) return true;
  return false;
}

void refuse_network_database(const std::filesystem::path& state_dir) {
  const std::string file_system = file_system_of(state_dir);
  if (is_bad_for_a_database(file_system))
    throw Error(
        ErrorKind::BadInput,
        fmt::format(
            "{}: lies on {}, where a database is not safe; give --state a folder on a disk of this "
            "machine (stores of shots may stay where they are); 'vantage run' keeps it in the shot: use 'vantage farm "
            "init' and 'vantage submit' for this one",
            state_dir.string(), file_system));
}

}  // namespace vantage

#pragma once
#include <filesystem>
#include <string>
#include <string_view>

namespace vantage {

/// Throws Error(Transient) naming the file.
std::string read_file(const std::filesystem::path& path);

/// Writes beside the file, fsyncs, renames into place, fsyncs the folder: readers see the old or the new text whole.
/// mode: of the new file, less the umask; 0600 for what holds a secret.
/// Throws Error(Resource) when the disk is full, Error(Transient) otherwise.
void write_file_atomically(const std::filesystem::path& path, std::string_view bytes, unsigned mode = 0644);

/// fsync of one file or folder.
void fsync_path(const std::filesystem::path& path);

/// Makes `link` a symbolic link to `target` in one step, replacing a file or link that is there.
void replace_symlink(const std::filesystem::path& target, const std::filesystem::path& link);

/// Free space for ordinary users on the file system of `path`.
std::uintmax_t free_disk_mb(const std::filesystem::path& path);

}  // namespace vantage

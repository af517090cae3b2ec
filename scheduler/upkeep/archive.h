#pragma once
/// A finished shot in one file for long keeping: a tar packed by zstd, which any machine can read without Vantage.
///
///   archive.json                     what it is: format, shot, when, farm, footage with hashes
///   jobs.json                        the job table
///   shot.toml  out/…                 with links resolved (also out/report.html)
///   .vantage/store/<kind>/<key>/…    the results of the present plan, with their manifests
///
/// A file of out/ and the artifact that it is of are one file in the tar. Footage is not in it.
#include <cstdint>
#include <filesystem>
#include <string>

namespace vantage {

struct ArchiveFacts {
  std::string shot;
  std::int64_t num_jobs = 0, num_artifacts = 0;
  std::uintmax_t num_bytes = 0;  ///< of the packed file
};

/// Packs, unpacks the result beside it to check every hash, and gives the file its name only then: needs room for both.
/// Throws Error(BadInput) when the shot is not done, a result is damaged, or the file is there; Error(Resource) when
/// tar or zstd are not installed or the disk is full.
ArchiveFacts pack_shot(const std::filesystem::path& shot_folder, const std::filesystem::path& state_dir,
                       const std::filesystem::path& to_file);

/// Unpacks into a new folder, checks every hash, and gives the folder its name only then.
/// Throws Error(BadInput) when the folder is there or the archive is damaged.
ArchiveFacts unpack_shot(const std::filesystem::path& file, const std::filesystem::path& to_folder);

/// Removes what an archive holds: store, specs, logs, and links in out/. Only of a store that is the shot's alone.
/// Throws Error(BadInput) when it is shared, or a scheduler of the shot's own runs.
void remove_archived(const std::filesystem::path& shot_folder);

}  // namespace vantage

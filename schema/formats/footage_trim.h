#pragma once
#include <filesystem>

namespace vantage {

/// trim.json of an ingest artifact, there when a person trimmed the camera's start: what frame 0 is in the whole
/// footage.
struct FootageTrim {
  int num_before = 0;  ///< pictures of the footage that come before frame 0
  double start_s = 0;  ///< presentation time of frame 0 since the footage's first picture
};

/// Nothing trimmed when there is no trim.json.
FootageTrim read_footage_trim(const std::filesystem::path& ingest_artifact);
void write_footage_trim(const std::filesystem::path& file, const FootageTrim& trim);

}  // namespace vantage

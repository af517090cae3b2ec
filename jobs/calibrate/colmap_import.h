#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "jobs/calibrate/picture_pair.h"
#include "jobs/calibrate/survey.h"

namespace vantage {

/// What COLMAP's importers read, as its documentation has it ("Feature Extraction", "Feature Matching").
struct ColmapImport {
  std::filesystem::path pictures;  ///< empty pictures of the right sizes: the importer asks for nothing else of them
  std::filesystem::path features;  ///< <name>.txt of each picture: where its features are, in order, no descriptors
  std::filesystem::path matches;   ///< of all pairs, by number of feature
};

/// Writes it below a folder. Throws Error(Resource) when the disk is full.
ColmapImport write_colmap_import(const std::filesystem::path& folder, const Survey& survey,
                                 const std::vector<PicturePair>& pairs);

}  // namespace vantage

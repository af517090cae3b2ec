#pragma once
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "jobs/calibrate/picture_pair.h"
#include "jobs/calibrate/survey.h"
#include "schema/formats/camera.h"

namespace vantage {

/// Fills a database that `colmap database_creator` has made (SQLite; tables as in COLMAP 3.8's documentation, "Database
/// format"): a camera for each lens, its pictures by Survey::Picture::name(), their features in order, and matches as
/// verified ones. lenses: by camera name, what mapping starts from. Throws Error(Resource) when it cannot be written.
void fill_colmap_database(const std::filesystem::path& file, const std::map<std::string, LensModel>& lenses,
                          const Survey& survey, const std::vector<PicturePair>& pairs);

}  // namespace vantage

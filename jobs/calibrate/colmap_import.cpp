#include "jobs/calibrate/colmap_import.h"

#include <fmt/format.h>

#include <iterator>

#include "jobs/vision/shot_images.h"
#include "schema/base/files.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

/// A line `x y scale orientation` and 128 numbers for each feature; the latter are read but matter only to COLMAP's own
/// matching.
std::string feature_text(const Survey::Picture& picture) {
  std::string rest = " 1 0";
  for (int i = 0; i < 128; ++i) rest += " 0";
  std::string text = fmt::format("{} 128\n", picture.num_features());
  for (const auto& glimpse : picture.glimpses)
    for (const auto& px : glimpse.features.px)
      fmt::format_to(std::back_inserter(text), "{:.9g} {:.9g}{}\n", px.x(), px.y(), rest);
  return text;
}

std::string match_text(const Survey& survey, const PicturePair& pair) {
  std::string text = fmt::format("{} {}\n", survey.pictures[static_cast<std::size_t>(pair.a)].name(),
                                 survey.pictures[static_cast<std::size_t>(pair.b)].name());
  for (const auto& m : pair.matches) fmt::format_to(std::back_inserter(text), "{} {}\n", m.a, m.b);
  return text + "\n";
}

}  // namespace

ColmapImport write_colmap_import(const fs::path& folder, const Survey& survey, const std::vector<PicturePair>& pairs) {
  const ColmapImport out{folder / "pictures", folder / "features", folder / "matches.txt"};
  for (const auto& picture : survey.pictures) {
    const fs::path file = out.pictures / picture.name(), text = out.features / (picture.name() + ".txt");
    fs::create_directories(file.parent_path());
    fs::create_directories(text.parent_path());
    write_picture(file, cv::Mat(picture.height, picture.width, CV_8U, cv::Scalar(0)));
    write_file_atomically(text, feature_text(picture));
  }
  std::string matches;
  for (const auto& pair : pairs)
    if (!pair.matches.empty()) matches += match_text(survey, pair);
  write_file_atomically(out.matches, matches);
  return out;
}

}  // namespace vantage

#include "jobs/calibrate/colmap.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

#include "jobs/calibrate/colmap_import.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/program.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

using Words = std::vector<std::string>;

/// One call of COLMAP. What it prints goes to the log in the work folder; its end is quoted when things go wrong.
class Colmap {
 public:
  explicit Colmap(const fs::path& work) : work_(work) {}

  int run(const std::string& command, const Words& words) const {
    Words argv{"colmap", command};
    argv.insert(argv.end(), words.begin(), words.end());
    return run_program(argv, {.stdout_file = {}, .stderr_file = log()});
  }
  [[noreturn]] void fail(const std::string& command, int status) const {
    const std::string text = fs::exists(log()) ? read_file(log()) : "";
    const std::string end = text.substr(text.size() > 300 ? text.size() - 300 : 0);
    throw Error(ErrorKind::Resource,
                fmt::format("colmap {} ended with status {} and without its output; its last words: {}", command,
                            status, one_line(end)));
  }
  fs::path log() const { return work_ / "colmap.log"; }

 private:
  static std::string one_line(std::string text) {
    for (char& c : text)
      if (c == '\n') c = ' ';
    return text;
  }
  const fs::path& work_;
};

/// A database of the survey's features and of matches that COLMAP takes as they are. One camera for each folder, i.e.
/// for each of ours; no distortion, the centre of the picture.
void fill_database(const Colmap& colmap, const fs::path& db, const ColmapImport& import, const MapperOptions& o) {
  const int features =
      colmap.run("feature_importer", {"--database_path", db.string(), "--image_path", import.pictures.string(),
                                      "--import_path", import.features.string(), "--ImageReader.camera_model", o.lens,
                                      "--ImageReader.single_camera_per_folder", "1",
                                      "--ImageReader.default_focal_length_factor", fmt::format("{}", o.focal_guess)});
  if (features != 0 || !fs::exists(db)) colmap.fail("feature_importer", features);
  const int matches =
      colmap.run("matches_importer", {"--database_path", db.string(), "--match_list_path", import.matches.string(),
                                      "--match_type", "inliers", "--SiftMatching.use_gpu", "0"});
  if (matches != 0) colmap.fail("matches_importer", matches);
}

/// Folder of the largest model, if any.
std::optional<fs::path> map_points(const Colmap& colmap, const fs::path& db, const fs::path& work,
                                   const MapperOptions& o) {
  const fs::path sparse = work / "sparse";
  fs::create_directories(sparse);
  Words words{"--database_path",
              db.string(),
              "--image_path",
              work.string(),
              "--output_path",
              sparse.string(),
              "--random_seed",
              "1",
              "--Mapper.extract_colors",
              "0",
              "--Mapper.num_threads",
              "1",
              "--Mapper.multiple_models",
              "0",
              "--Mapper.min_model_size",
              "2",
              "--Mapper.filter_max_reproj_error",
              fmt::format("{}", o.max_reproj_error_px)};
  if (!o.free_lens) words.insert(words.end(), {"--Mapper.ba_refine_extra_params", "0"});
  if (o.loose)
    for (const char* word : {"--Mapper.init_min_tri_angle", "4", "--Mapper.init_min_num_inliers", "30",
                             "--Mapper.abs_pose_min_num_inliers", "12", "--Mapper.abs_pose_min_inlier_ratio", "0.15",
                             "--Mapper.min_num_matches", "10"})
      words.emplace_back(word);
  const int status = colmap.run("mapper", words);
  if (status >= 128) colmap.fail("mapper", status);
  const fs::path model = sparse / "0";
  return fs::exists(model / "images.bin") ? std::optional(model) : std::nullopt;
}

/// What COLMAP was not told: when each feature was seen, and its colour.
void add_what_was_seen(const Survey& survey, SparseModel& model) {
  struct Seen {
    std::vector<std::optional<int>> frame;
    std::vector<Eigen::Vector3i> rgb;
    std::vector<Eigen::Vector2d> carried_px;
  };
  std::map<ImageId, Seen> seen;
  for (const auto& picture : survey.pictures) {
    Seen& s = seen[picture.image];
    for (const auto& g : picture.glimpses)
      for (std::size_t i = 0; i < g.features.size(); ++i) {
        s.frame.push_back(g.frame);
        s.rgb.push_back(g.features.rgb[i]);
        s.carried_px.push_back(g.carried_px.empty() ? Eigen::Vector2d(0, 0) : g.carried_px[i]);
      }
  }
  for (auto& o : model.observations) {
    const Seen& s = seen.at(o.image);
    const auto feature = static_cast<std::size_t>(o.feature);
    o.frame = s.frame[feature];
    o.carried_px = s.carried_px[feature];
    model.points[static_cast<std::size_t>(o.point)].rgb = s.rgb[feature];
  }
}

}  // namespace

SparseModel map_with_colmap(const Survey& survey, const std::vector<PicturePair>& pairs, const fs::path& work,
                            const MapperOptions& options) {
  fs::remove_all(work);
  fs::create_directories(work);
  const Colmap colmap(work);
  const fs::path db = work / "database.db", text = work / "text";
  fill_database(colmap, db, write_colmap_import(work, survey, pairs), options);
  const auto model = map_points(colmap, db, work, options);
  if (!model) return {};
  fs::create_directories(text);
  const int status = colmap.run(
      "model_converter", {"--input_path", model->string(), "--output_path", text.string(), "--output_type", "TXT"});
  if (status != 0 || !fs::exists(text / "images.txt")) colmap.fail("model_converter", status);
  SparseModel out = read_sparse_model(text);
  add_what_was_seen(survey, out);
  return out;
}

}  // namespace vantage

#include "jobs/calibrate/colmap.h"

#include <fmt/format.h>

#include <optional>

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
  Colmap(const fs::path& work, const ColmapOptions& options) : work_(work), options_(options) {}

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
  std::string threads() const { return std::to_string(options_.num_threads); }

 private:
  static std::string one_line(std::string text) {
    for (char& c : text)
      if (c == '\n') c = ' ';
    return text;
  }
  const fs::path& work_;
  const ColmapOptions& options_;
};

void extract_features(const Colmap& colmap, const fs::path& pictures, const fs::path& db, const ColmapOptions& o) {
  Words words{"--database_path",
              db.string(),
              "--image_path",
              pictures.string(),
              "--ImageReader.single_camera_per_folder",
              "1",
              "--ImageReader.camera_model",
              o.lens,
              "--SiftExtraction.use_gpu",
              "0",
              "--SiftExtraction.num_threads",
              colmap.threads(),
              "--SiftExtraction.max_image_size",
              std::to_string(o.max_picture_px),
              "--SiftExtraction.max_num_features",
              std::to_string(o.max_features)};
  if (o.loose)
    for (const char* word : {"--SiftExtraction.peak_threshold", "0.0025", "--SiftExtraction.estimate_affine_shape", "1",
                             "--SiftExtraction.domain_size_pooling", "1"})
      words.emplace_back(word);
  const int status = colmap.run("feature_extractor", words);
  if (status != 0 || !fs::exists(db)) colmap.fail("feature_extractor", status);
}

void match(const Colmap& colmap, const std::vector<PicturePair>& pairs, const fs::path& db, const fs::path& list,
           const ColmapOptions& o) {
  std::string text;
  for (const auto& [a, b] : pairs) text += a + " " + b + "\n";
  write_file_atomically(list, text);
  const int status =
      colmap.run("matches_importer",
                 {"--database_path", db.string(), "--match_list_path", list.string(), "--match_type", "pairs",
                  "--SiftMatching.use_gpu", "0", "--SiftMatching.num_threads", colmap.threads(),
                  "--SiftMatching.guided_matching", o.loose ? "1" : "0", "--SiftMatching.max_error",
                  fmt::format("{}", o.max_reproj_error_px), "--SiftMatching.max_ratio", o.loose ? "0.85" : "0.8"});
  if (status != 0) colmap.fail("matches_importer", status);
}

/// Folder of the largest model, if any.
std::optional<fs::path> map_points(const Colmap& colmap, const fs::path& pictures, const fs::path& db,
                                   const fs::path& sparse, const ColmapOptions& o) {
  fs::create_directories(sparse);
  Words words{"--database_path",
              db.string(),
              "--image_path",
              pictures.string(),
              "--output_path",
              sparse.string(),
              "--random_seed",
              "1",
              "--Mapper.num_threads",
              colmap.threads(),
              "--Mapper.multiple_models",
              "0",
              "--Mapper.min_model_size",
              "2",
              "--Mapper.filter_max_reproj_error",
              fmt::format("{}", o.max_reproj_error_px)};
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

}  // namespace

SparseModel run_colmap(const fs::path& pictures, const std::vector<PicturePair>& pairs, const fs::path& work,
                       const ColmapOptions& options) {
  const Colmap colmap(work, options);
  const auto progress = [&](double fraction, const char* phase) {
    if (options.on_progress) options.on_progress(fraction, phase);
  };
  const fs::path db = work / "database.db", text = work / "text";
  progress(0, "features");
  extract_features(colmap, pictures, db, options);
  progress(0.3, "matches");
  match(colmap, pairs, db, work / "pairs.txt", options);
  progress(0.8, "cameras and points");
  const auto model = map_points(colmap, pictures, db, work / "sparse", options);
  if (!model) return {};
  fs::create_directories(text);
  const int status = colmap.run(
      "model_converter", {"--input_path", model->string(), "--output_path", text.string(), "--output_type", "TXT"});
  if (status != 0 || !fs::exists(text / "images.txt")) colmap.fail("model_converter", status);
  return read_sparse_model(text);
}

}  // namespace vantage

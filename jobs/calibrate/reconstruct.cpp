#include "jobs/calibrate/reconstruct.h"

#include <algorithm>
#include <atomic>
#include <future>

#include "jobs/calibrate/colmap.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

using Progress = std::function<void(double, const std::string&)>;

/// What the mapper begins with: its first pair is placed with the focal length as it is, in longer sides of the
/// picture; all later pictures find theirs.
struct Start {
  double focal_guess;
  bool free_lens;
};
/// A normal lens, one that distorts, a wide one and a long one.
constexpr Start kStarts[] = {{1.2, false}, {1.2, true}, {0.7, false}, {2.2, false}};
/// Few pictures are mapped within seconds: all starts are tried and the one that explains most is kept.
constexpr std::size_t kQuicklyMapped = 20;

/// Every pair is matched by itself, so the number of threads changes nothing.
std::vector<PicturePair> match_all(const Survey& survey, const MatchOptions& options, int num_threads,
                                   const std::function<void(double)>& on_progress) {
  const auto wanted = survey.pairs();
  std::vector<PicturePair> out(wanted.size());
  std::atomic<std::size_t> next = 0;
  const auto work = [&](bool tells) {
    for (std::size_t i = next++; i < wanted.size(); i = next++) {
      out[i] = match_pictures(survey, wanted[i].first, wanted[i].second, options);
      if (tells) on_progress(static_cast<double>(i) / static_cast<double>(wanted.size()));
    }
  };
  std::vector<std::future<void>> helpers;
  for (int i = 1; i < num_threads; ++i) helpers.push_back(std::async(std::launch::async, work, false));
  work(true);
  for (auto& helper : helpers) helper.get();
  return out;
}

auto rank(const SparseModel& model) {
  return std::tuple(model.lenses.size(), model.cam_from_world.size(), model.observations.size());
}

Reconstruction attempt(const std::vector<FilmedCamera>& cameras, const Footage& footage,
                       const CalibrateJob::Params& params, bool loose, const fs::path& work, int num_threads,
                       const Progress& on_progress) {
  const SurveyOptions seen{
      .features = {.max_side_px = params.feature_width_px, .max_features = params.max_features, .faint = loose},
      .plate_frames = params.plate_frames,
      .max_key_frames = params.max_key_frames};
  const MatchOptions matched{.max_error_px = params.max_reproj_error_px, .max_ratio = loose ? 0.85 : 0.8};
  const Survey survey = take_survey(cameras, footage, seen, [&](double f) { on_progress(0.4 * f, "features"); });
  const auto pairs = match_all(survey, matched, num_threads, [&](double f) { on_progress(0.4 + 0.4 * f, "matches"); });
  Reconstruction out;
  for (const auto& pair : pairs)
    if (pair.matches.size() >= out.best_pair.num_matches)
      out.best_pair = {survey.pictures[static_cast<std::size_t>(pair.a)].image.camera,
                       survey.pictures[static_cast<std::size_t>(pair.b)].image.camera, pair.matches.size()};
  for (const Start& start : kStarts) {
    on_progress(0.8, "cameras and points");
    SparseModel model = map_with_colmap(survey, pairs, work,
                                        {.lens = params.lens,
                                         .focal_guess = start.focal_guess,
                                         .max_reproj_error_px = params.max_reproj_error_px,
                                         .free_lens = start.free_lens,
                                         .loose = loose});
    if (rank(model) > rank(out.model)) out.model = std::move(model);
    if (out.model.lenses.size() == cameras.size() && survey.pictures.size() > kQuicklyMapped) break;
  }
  return out;
}

}  // namespace

Reconstruction reconstruct(const std::vector<FilmedCamera>& cameras, const Footage& footage,
                           const CalibrateJob::Params& params, const fs::path& work, int num_threads,
                           const Progress& on_progress) {
  Reconstruction first = attempt(cameras, footage, params, false, work, num_threads,
                                 [&](double f, const std::string& phase) { on_progress(0.5 * f, phase); });
  if (first.model.lenses.size() == cameras.size()) return first;
  Reconstruction second =
      attempt(cameras, footage, params, true, work, num_threads,
              [&](double f, const std::string& phase) { on_progress(0.5 + 0.5 * f, phase + ", second attempt"); });
  return rank(second.model) > rank(first.model) ? second : first;
}

}  // namespace vantage

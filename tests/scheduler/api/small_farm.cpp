#include "tests/scheduler/api/small_farm.h"

#include <fmt/format.h>

#include "scheduler/store/migrations.h"
#include "schema/base/files.h"
#include "schema/formats/calibration.h"
#include "schema/formats/clocks.h"
#include "schema/formats/frame_table.h"
#include "schema/formats/manifest.h"
#include "schema/formats/navspace.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr const char* kShotToml = R"([shot]
name = "dance"
[[camera]]
name = "left"
footage = "left.mp4"
[[camera]]
name = "right"
footage = "right.mp4"
[depth]
[[render]]
name = "freeze"
keyframes = [{ at_s = 0, time_s = 0.1, azimuth_deg = -5 }, { at_s = 1, time_s = 0.1, azimuth_deg = 5 }]
)";

Sqlite open_to_write(const fs::path& state_dir) {
  fs::create_directories(state_dir);
  Sqlite db(state_dir / "farm.sqlite", Sqlite::Mode::ReadWrite);
  db.script("PRAGMA synchronous = OFF");
  migrate(db, all_migrations());
  return db;
}

/// A picture that every browser reads and that needs no library to write.
std::string picture(const std::string& name, int hue) {
  return fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 480 270'><defs><linearGradient id='g'><stop "
      "stop-color='hsl({0} 80% 60%)'/>"
      "<stop offset='1' stop-color='hsl({1} 80% 30%)'/></linearGradient></defs><rect width='480' height='270' "
      "fill='url(#g)'/>"
      "<text x='20' y='40' fill='white' font-size='24'>{2}</text></svg>",
      hue, hue + 120, name);
}

CameraModel camera(const std::string& name, int id) {
  return {.name = name,
          .id = id,
          .pinhole = {.width = 640, .height = 360, .fx = 600, .fy = 600, .cx = 320, .cy = 180},
          .filmed = {}};
}

Calibration two_cameras() {
  Calibration c;
  c.cameras = {{"left", camera("left", 1)}, {"right", camera("right", 2)}};
  for (const double x : {-1.0, 1.0})
    c.cam_from_world[{x < 0 ? "left" : "right", 0}] = {.R = Eigen::Matrix3d::Identity(), .t = {-x, 0, 0}};
  for (int i = 0; i < 50; ++i)
    c.points.push_back({.position = {0.1 * (i % 10) - 0.5, 0, 4 + 0.1 * (i / 10)},
                        .rgb = {200, 120, 40},
                        .error_px = 0.4,
                        .seen_in = {}});
  return c;
}

Navspace four_images() {
  Navspace n;
  for (int frame = 0; frame < 2; ++frame) {
    n.vertices.push_back({{"left", frame}, -10, 0, 0.1 * frame});
    n.vertices.push_back({{"right", frame}, 10, 0, 0.1 * frame + 0.03});
  }
  n.simplices = {{0, 1, 2}, {1, 2, 3}};
  n.edges = {{0, 1}, {0, 2}, {1, 2}, {1, 3}, {2, 3}};
  return n;
}

/// The pattern that all copies are made from.
class Model {
 public:
  Model() : db_(open_to_write(shot() / ".vantage" / "farm")) {
    write_shot();
    db_.script("BEGIN");
    write_rows();
    count_jobs(db_);
    db_.script("COMMIT; PRAGMA wal_checkpoint(TRUNCATE)");
    write_results();
  }
  fs::path shot() const { return folder_.path() / "dance"; }

 private:
  void write_shot();
  void write_rows();
  void write_results();
  /// Files, and the manifest that makes them a result.
  void write_artifact(const std::string& kind, const std::string& key, const std::string& job);
  fs::path artifact(const std::string& kind, const std::string& key) const {
    return artifact_folder(shot() / ".vantage" / "store", kind, key);
  }

  TemporaryFolder folder_;
  Sqlite db_;
};

void Model::write_shot() {
  write_file_atomically(shot() / "shot.toml", kShotToml);
  write_file_atomically(shot() / "left.mp4", "not read here");
  write_file_atomically(shot() / "right.mp4", "not read here");
  fs::create_directories(shot() / "out" / "render" / "freeze");
  write_file_atomically(shot() / "out" / "render" / "freeze" / "freeze.mp4", "0123456789");
  write_file_atomically(shot() / ".vantage" / "secret.txt", "not for people");
}

void Model::write_rows() {
  db_.run(
      "INSERT INTO shot (id, folder, name, state, generation, submitted_ms) VALUES (1, ?, 'dance', 'running', 1, "
      "1000000)",
      shot().string());
  const auto job = [&](const std::string& name, const char* state, const char* key, const char* reason, int wall_ms,
                       int generation = 1) {
    db_.run(
        "INSERT INTO job (shot_id, name, kind, stage, version, generation, plan_hash, params, unit, sources, links, "
        "key, "
        "state, cores, ram_mb, timeout_s, reason, wall_ms, peak_rss_mb, created_ms) "
        "VALUES (1, ?, ?, 0, 1, ?, '', '{}', '{\"camera\":\"left\"}', '[]', '[]', ?, ?, 1, 1000, 60, ?, ?, 210, "
        "1000000)",
        name, name.substr(0, name.find('/')), generation, key, state, reason, wall_ms);
  };
  job("ingest/left", "done", "a1", "new", 1500);
  job("ingest/right", "skipped", "a2", "up to date: the same result is in the store", 0);
  job("calibrate", "done", "b1", "new", 8000);
  job("correspond/left-000000__right-000000", "done", "c1", "new", 2500);
  job("correspond/left-000000__left-000001", "running", "c2", "new", 0);
  job("depth/left-000000", "failed", "d1", "new", 300);
  for (int i = 0; i < 6; ++i)
    job(fmt::format("render/freeze/{:06d}", i), "blocked", "", "waits for correspond/left-000000__left-000001", 0);
  job("align", "done", "e1", "new", 20);
  job("navspace", "done", "f1", "new", 30);
  job("depth/old", "failed", "", "not in the plan any more", 0, 0);
  db_.run("UPDATE job SET progress = 0.4, phase = 'backward flow', num_attempts = 1 WHERE id = 5");
  db_.run(
      "UPDATE job SET error_kind = 'bad_input', error = 'left-000000: no edge <with> depth', num_attempts = 2 WHERE id "
      "= 6");
  db_.run("INSERT INTO dependency (job_id, needs_id) VALUES (7, 5), (7, 4)");
  db_.run(
      "INSERT INTO worker (id, incarnation, host, slots, cores, ram_mb, free_disk_mb, state, last_seen_ms) VALUES "
      "('w1', 7, 'studio', 2, 8, 16000, 90000, 'active', 1000000)");
  const auto attempt = [&](int job_id, int number, const char* state, const char* outcome, const fs::path& log) {
    db_.run(
        "INSERT INTO attempt (job_id, number, token, worker_id, key, state, outcome, error, log_path, leased_ms, "
        "wall_ms) "
        "VALUES (?, ?, 1, 'w1', '', ?, ?, '', ?, 1000000, 300)",
        job_id, number, state, outcome, log.string());
  };
  const fs::path log = shot() / ".vantage" / "logs" / "depth.log";
  fs::create_directories(log.parent_path());
  write_file_atomically(log, "reading maps\nno edge with depth\n");
  attempt(5, 1, "running", "", log);
  attempt(6, 1, "ended", "crashed", log);
  attempt(6, 2, "ended", "failed", log);
  db_.run("INSERT INTO event (at_ms, shot_id, job_id, kind, text) VALUES (1000000, 1, 6, 'state', 'ready: new')");
}

void Model::write_artifact(const std::string& kind, const std::string& key, const std::string& job) {
  const fs::path folder = artifact(kind, key);
  const auto files = list_artifact_files(folder);
  write_manifest(folder,
                 {.kind = kind,
                  .version = 1,
                  .job = job,
                  .key = key,
                  .content = content_hash(files),
                  .files = files,
                  .figures = {{"inliers", 812}, {"error_px", 0.43217}, {"warnings", {"few <features> in " + job}}},
                  .provenance = Json::object()});
}

void Model::write_results() {
  for (const auto& [kind, key] : {std::pair{"ingest", "a1"},
                                  {"ingest", "a2"},
                                  {"calibrate", "b1"},
                                  {"correspond", "c1"},
                                  {"align", "e1"},
                                  {"navspace", "f1"}})
    fs::create_directories(artifact(kind, key));
  for (const auto& [name, key] : {std::pair{"left", "a1"}, {"right", "a2"}}) {
    write_frame_table(artifact("ingest", key) / "frames.json",
                      {.camera = name, .width = 640, .height = 360, .fps = 30, .pts_s = {0, 1.0 / 30}});
    write_file_atomically(artifact("ingest", key) / "preview.svg", picture(name, 20));
    write_artifact("ingest", key, std::string("ingest/") + name);
  }
  write_calibration(artifact("calibrate", "b1"), two_cameras());
  write_artifact("calibrate", "b1", "calibrate");
  write_file_atomically(artifact("correspond", "c1") / "preview.svg", picture("flow", 200));
  write_artifact("correspond", "c1", "correspond/left-000000__right-000000");
  write_clocks(artifact("align", "e1") / "clocks.json",
               {.reference = "left", .cameras = {{"left", 0, 1, 0}, {"right", 0.0333, 1, 0.0012}}});
  write_artifact("align", "e1", "align");
  write_navspace(artifact("navspace", "f1") / "navspace.json", four_images());
  write_artifact("navspace", "f1", "navspace");
}

/// A copy of the model whose rows name the copy's own paths.
Sqlite open_copy(const fs::path& shot) {
  static const Model model;
  fs::copy(model.shot(), shot, fs::copy_options::recursive);
  Sqlite db = open_to_write(shot / ".vantage" / "farm");
  db.run("UPDATE shot SET folder = ?", shot.string());
  db.run("UPDATE attempt SET log_path = replace(log_path, ?, ?)", model.shot().string(), shot.string());
  return db;
}

}  // namespace

void count_jobs(Sqlite& db) {
  db.run("DELETE FROM job_count");
  db.run(
      "INSERT INTO job_count (shot_id, kind, state, num, wall_ms) SELECT shot_id, kind, job.state, count(*), "
      "sum(wall_ms) FROM job JOIN shot ON shot.id = shot_id WHERE job.generation = shot.generation GROUP BY shot_id, "
      "kind, job.state");
}

SmallFarm::SmallFarm() : db_(open_copy(shot())) {}

}  // namespace vantage

#include "scheduler/api/queries.h"

#include <fmt/format.h>

#include <algorithm>

#include "jobs/all_jobs.h"
#include "scheduler/dispatch/why_waiting.h"
#include "scheduler/dispatch/working_hours.h"
#include "scheduler/estimate/shot_estimate.h"
#include "scheduler/report/html.h"
#include "schema/base/clock.h"
#include "schema/base/did_you_mean.h"
#include "schema/formats/manifest.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

// Jobs of an older generation belong to a plan that was replaced: nobody wants to see them.
constexpr const char* kShotColumns =
    "SELECT id, name, folder, state, error, until_kind, submitted_ms, finished_ms, priority FROM shot ";
constexpr const char* kOneJob =
    "SELECT job.id, job.name, job.kind, job.state, phase, progress, num_attempts, wall_ms, peak_rss_mb, reason, "
    "error_kind, job.error, key, shot.folder FROM job JOIN shot ON shot.id = job.shot_id WHERE job.id = ?";
constexpr const char* kEventColumns = "SELECT id, at_ms, shot_id, job_id, worker_id, kind, text, who FROM event ";
constexpr std::int64_t kMaxInputs = 1000;
constexpr std::int64_t kMaxSuggestions = 20'000;  ///< names that a wrong one is compared with

Json integer_or_null(const Query& row, int column) { return row.is_null(column) ? Json() : Json(row.integer(column)); }

/// When a worker with these hours begins jobs again; null while it may.
Json next_opening(const std::string& hours) {
  const auto next_ms = WorkingHours::parse(hours).next_opening_ms(system_clock().wall_ms());
  return next_ms ? Json(*next_ms) : Json();
}

fs::path result_folder(const fs::path& shot_folder, const std::string& kind, const std::string& key) {
  if (key.empty()) return {};
  const fs::path folder = artifact_folder(shot_folder / ".vantage" / "store", kind, key);
  return fs::exists(folder / "manifest.json") ? folder : fs::path{};
}

Json films_of(const fs::path& shot_folder) {
  Json films = Json::array();
  const fs::path out = shot_folder / "out";
  std::error_code none;
  for (const auto& render : fs::directory_iterator(out / "render", none))
    for (const auto& entry : fs::directory_iterator(render.path(), none))
      if (entry.path().extension() == ".mp4" && fs::is_regular_file(entry.path()))
        films.push_back({{"render", render.path().filename().string()},
                         {"file", entry.path().filename().string()},
                         {"path", entry.path().lexically_relative(out).string()}});
  std::sort(films.begin(), films.end(), [](const Json& a, const Json& b) { return a.at("path") < b.at("path"); });
  return films;
}

}  // namespace

Json FarmQueries::counts(std::int64_t shot_id, const std::string& kind) {
  Json out = Json::object();
  for (auto row = db_.query("SELECT state, sum(num) FROM job_count WHERE shot_id = ?1 AND (?2 = '' OR kind = ?2) "
                            "GROUP BY state HAVING sum(num) > 0",
                            shot_id, kind);
       row.step();)
    out[row.text(0)] = row.integer(1);
  return out;
}

std::vector<FarmQueries::Count> FarmQueries::counts_of_all() {
  std::vector<Count> counts;
  for (auto row = db_.query("SELECT kind, state, sum(num) FROM job_count GROUP BY kind, state"); row.step();)
    counts.push_back({row.text(0), row.text(1), row.integer(2)});
  return counts;
}

std::map<std::string, std::int64_t> FarmQueries::num_shots() {
  std::map<std::string, std::int64_t> num;
  for (auto row = db_.query("SELECT state, count(*) FROM shot GROUP BY state"); row.step();)
    num[row.text(0)] = row.integer(1);
  return num;
}

std::map<std::string, std::int64_t> FarmQueries::num_workers() {
  std::map<std::string, std::int64_t> num;
  for (auto row = db_.query("SELECT state, count(*) FROM worker GROUP BY state"); row.step();)
    num[row.text(0)] = row.integer(1);
  return num;
}

Json FarmQueries::shot_row(const Query& row) {
  return {{"id", row.integer(0)},           {"name", row.text(1)},
          {"folder", row.text(2)},          {"state", row.text(3)},
          {"error", row.text(4)},           {"until", row.text(5)},
          {"submitted_ms", row.integer(6)}, {"finished_ms", integer_or_null(row, 7)},
          {"priority", row.integer(8)}};
}

Json FarmQueries::shots() {
  Json shots = Json::array();
  for (auto row = db_.query(std::string(kShotColumns) + "ORDER BY id"); row.step();) shots.push_back(shot_row(row));
  for (auto& shot : shots) shot["counts"] = counts(shot.at("id"), "");
  return {{"shots", std::move(shots)}};
}

Json FarmQueries::shot(std::int64_t shot_id) {
  Json out;
  {
    auto row = db_.query(std::string(kShotColumns) + "WHERE id = ?", shot_id);
    if (!row.step()) throw NotFound(fmt::format("there is no shot {}", shot_id));
    out = shot_row(row);
  }
  out["counts"] = counts(shot_id, "");
  out["stages"] = Json::array();
  for (const auto& kind : all_kinds()) {
    const std::string name(kind.spec.name);
    const auto wall_ms =
        db_.integer_or(0, "SELECT sum(wall_ms) FROM job_count WHERE shot_id = ? AND kind = ?", shot_id, name);
    out["stages"].push_back(
        {{"kind", name}, {"publishes", kind.spec.publishes}, {"counts", counts(shot_id, name)}, {"wall_ms", wall_ms}});
  }
  const fs::path folder = out.at("folder").get<std::string>();
  out["films"] = films_of(folder);
  out["has_report"] = fs::exists(folder / "out" / "report.html");
  return out;
}

Json FarmQueries::job_row(const Query& row) {
  const fs::path result = result_folder(row.text(13), row.text(2), row.text(12));
  return {{"id", row.integer(0)},
          {"name", row.text(1)},
          {"kind", row.text(2)},
          {"state", row.text(3)},
          {"phase", row.text(4)},
          {"progress", row.real(5)},
          {"num_attempts", row.integer(6)},
          {"wall_ms", row.integer(7)},
          {"peak_rss_mb", row.integer(8)},
          {"reason", row.text(9)},
          {"error_kind", row.text(10)},
          {"error", row.text(11)},
          {"key", row.text(12)},
          {"has_preview", !html::preview_of(result).empty()}};
}

std::int64_t FarmQueries::count_of(std::int64_t shot_id, const JobFilter& filter) {
  const std::string states = "," + filter.states + ",";
  const Json by_state = counts(shot_id, filter.kind);
  std::int64_t sum = 0;
  for (const auto& [state, num] : by_state.items())
    if (filter.states.empty() || states.find("," + state + ",") != std::string::npos) sum += num.get<std::int64_t>();
  return sum;
}

Json FarmQueries::jobs(std::int64_t shot_id, const JobFilter& filter) {
  shot_folder(shot_id);
  const JobPage page = read_job_page(db_, shot_id, filter);
  Json jobs = Json::array();
  for (const auto id : page.ids)
    if (auto row = db_.query(kOneJob, id); row.step()) jobs.push_back(job_row(row));
  const bool by_name = !filter.text.empty() || !filter.name.empty();
  return {{"total", by_name ? Json() : Json(count_of(shot_id, filter))},
          {"jobs", std::move(jobs)},
          {"after", page.after.empty() ? Json() : Json(page.after)}};
}

Json FarmQueries::event_row(const Query& row) {
  return {{"id", row.integer(0)},
          {"at_ms", row.integer(1)},
          {"shot", integer_or_null(row, 2)},
          {"job", integer_or_null(row, 3)},
          {"worker", row.text(4)},
          {"kind", row.text(5)},
          {"text", row.text(6)},
          {"who", row.text(7)}};
}

Json FarmQueries::events_after(std::int64_t id, std::int64_t limit) {
  Json out = Json::array();
  for (auto row = db_.query(std::string(kEventColumns) + "WHERE id > ? ORDER BY id LIMIT ?", id, limit); row.step();)
    out.push_back(event_row(row));
  return out;
}

Json FarmQueries::audit(std::int64_t before, std::int64_t limit) {
  Json out = Json::array();
  for (auto row = db_.query(std::string(kEventColumns) + "WHERE kind NOT IN ('state', 'attempt') AND id < ? "
                                                         "ORDER BY id DESC LIMIT ?",
                            before, limit);
       row.step();)
    out.push_back(event_row(row));
  return {{"events", std::move(out)}};
}

Json FarmQueries::attempts(std::int64_t job_id) {
  Json out = Json::array();
  for (auto row = db_.query(
           "SELECT number, worker_id, state, outcome, error_kind, error, exit_code, signal, leased_ms, ended_ms, "
           "wall_ms, peak_rss_mb, log_path FROM attempt WHERE job_id = ? ORDER BY number DESC",
           job_id);
       row.step();)
    out.push_back({{"number", row.integer(0)},
                   {"worker", row.text(1)},
                   {"state", row.text(2)},
                   {"outcome", row.text(3)},
                   {"error_kind", row.text(4)},
                   {"error", row.text(5)},
                   {"exit_code", row.integer(6)},
                   {"signal", row.integer(7)},
                   {"leased_ms", row.integer(8)},
                   {"ended_ms", integer_or_null(row, 9)},
                   {"wall_ms", row.integer(10)},
                   {"peak_rss_mb", row.integer(11)},
                   {"log_path", row.text(12)}});
  return out;
}

Json FarmQueries::inputs(std::int64_t job_id) {
  Json out = Json::array();
  for (auto row = db_.query("SELECT job.id, name, state FROM dependency JOIN job ON job.id = needs_id WHERE job_id = ? "
                            "ORDER BY job.id LIMIT ?",
                            job_id, kMaxInputs);
       row.step();)
    out.push_back({{"id", row.integer(0)}, {"name", row.text(1)}, {"state", row.text(2)}});
  return out;
}

Json FarmQueries::history(std::int64_t job_id) {
  Json out = Json::array();
  for (auto row = db_.query("SELECT at_ms, kind, text FROM event WHERE job_id = ? ORDER BY id DESC LIMIT 20", job_id);
       row.step();)
    out.push_back({{"at_ms", row.integer(0)}, {"kind", row.text(1)}, {"text", row.text(2)}});
  return out;
}

Json FarmQueries::job(std::int64_t job_id) {
  Json out;
  fs::path folder;
  {
    auto row = db_.query(kOneJob, job_id);
    if (!row.step()) throw NotFound(fmt::format("there is no job {}", job_id));
    out = job_row(row);
    folder = row.text(13);
  }
  {
    auto row = db_.query("SELECT shot_id, cores, ram_mb, timeout_s, params, unit, links FROM job WHERE id = ?", job_id);
    check(row.step(), "the job was there a moment ago and jobs are never deleted");
    out.update({{"shot_id", row.integer(0)},
                {"cores", row.integer(1)},
                {"ram_mb", row.integer(2)},
                {"timeout_s", row.integer(3)},
                {"params", Json::parse(row.text(4))},
                {"unit", Json::parse(row.text(5))},
                {"links", Json::parse(row.text(6))}});
  }
  out.update({{"attempts", attempts(job_id)},
              {"inputs", inputs(job_id)},
              {"history", history(job_id)},
              {"reproduce", reproduce_command(job_id)},
              {"waits", why_waiting(db_, {job_id}, system_clock().wall_ms())},
              {"figures", Json::object()},
              {"files", Json::array()}});
  const fs::path result = result_folder(folder, out.at("kind"), out.at("key"));
  out["artifact"] = result.string();
  if (const auto manifest = result.empty() ? std::nullopt : read_valid_manifest(result)) {
    out["figures"] = manifest->figures;
    for (const auto& file : manifest->files) out["files"].push_back({{"path", file.path}, {"size", file.size}});
  }
  return out;
}

Json FarmQueries::estimate(std::int64_t shot_id) {
  shot_folder(shot_id);
  const auto found = estimate_shot(db_, ShotId{shot_id}, kind_names(), system_clock().wall_ms());
  const ShotEstimate estimate =
      found.value_or(ShotEstimate{.rest = {}, .why = "the shot has ended", .critical_path = {}});
  const auto num_retried =
      db_.integer_or(0,
                     "SELECT count(DISTINCT job_id) FROM attempt JOIN job ON job.id = job_id WHERE number > 1 "
                     "AND shot_id = ?1 AND generation = (SELECT generation FROM shot WHERE id = ?1)",
                     shot_id);
  Json rest, path = Json::array();
  if (estimate.rest)
    rest = {{"low_s", estimate.rest->low_s},
            {"middle_s", estimate.rest->middle_s},
            {"high_s", estimate.rest->high_s},
            {"unknown_kinds", estimate.rest->unknown_kinds}};
  for (const auto& job : estimate.critical_path)
    path.push_back({{"id", job.id.value}, {"name", job.name}, {"state", job.state}});
  return {{"rest", rest},
          {"why", estimate.why},
          {"critical_path", std::move(path)},
          {"critical_path_s", estimate.critical_path_s},
          {"num_retried", num_retried}};
}

Json FarmQueries::running_on(const std::string& worker_id) {
  Json out = Json::array();
  for (auto row = db_.query(
           "SELECT job.id, name, phase, progress FROM attempt JOIN job ON job.id = job_id WHERE worker_id = ? "
           "AND attempt.state = 'running' ORDER BY attempt.id",
           worker_id);
       row.step();)
    out.push_back({{"id", row.integer(0)}, {"name", row.text(1)}, {"phase", row.text(2)}, {"progress", row.real(3)}});
  return out;
}

Json FarmQueries::workers() {
  Json out = Json::array();
  for (auto row = db_.query("SELECT id, host, pool, slots, cores, ram_mb, free_disk_mb, state, last_seen_ms, "
                            "tags, kinds, build, trouble, skew_ms, hours, set_aside FROM worker ORDER BY state, id");
       row.step();)
    out.push_back({{"id", row.text(0)},
                   {"host", row.text(1)},
                   {"pool", row.text(2)},
                   {"slots", row.integer(3)},
                   {"cores", row.integer(4)},
                   {"ram_mb", row.integer(5)},
                   {"free_disk_mb", row.integer(6)},
                   {"state", row.text(7)},
                   {"last_seen_ms", row.integer(8)},
                   {"tags", row.text(9)},
                   {"kinds", row.text(10)},
                   {"build", row.text(11)},
                   {"trouble", row.text(12)},
                   {"skew_ms", row.integer(13)},
                   {"hours", row.text(14)},
                   {"next_opening_ms", next_opening(row.text(14))},
                   {"set_aside", row.text(15)}});
  for (auto& worker : out) worker["running"] = running_on(worker.at("id"));
  return {{"workers", std::move(out)}};
}

fs::path FarmQueries::shot_folder(std::int64_t shot_id) {
  const std::string folder = db_.text_or("", "SELECT folder FROM shot WHERE id = ?", shot_id);
  if (folder.empty()) throw NotFound(fmt::format("there is no shot {}", shot_id));
  return folder;
}

fs::path FarmQueries::log_path(std::int64_t job_id, std::optional<int> attempt) {
  return db_.text_or(
      "", "SELECT log_path FROM attempt WHERE job_id = ?1 AND (?2 < 0 OR number = ?2) ORDER BY number DESC LIMIT 1",
      job_id, attempt.value_or(-1));
}

fs::path FarmQueries::preview_path(std::int64_t job_id) {
  auto row = db_.query("SELECT folder, kind, key FROM job JOIN shot ON shot.id = shot_id WHERE job.id = ?", job_id);
  if (!row.step()) throw NotFound(fmt::format("there is no job {}", job_id));
  return html::preview_of(result_folder(row.text(0), row.text(1), row.text(2)));
}

std::int64_t FarmQueries::job_by_name(std::int64_t shot_id, const std::string& name) {
  const auto found = db_.integer_or(-1, "SELECT id FROM job WHERE shot_id = ? AND name = ?", shot_id, name);
  if (found >= 0) return found;
  std::vector<std::string> names;
  for (auto row = db_.query("SELECT name FROM job WHERE shot_id = ? LIMIT ?", shot_id, kMaxSuggestions); row.step();)
    names.push_back(row.text(0));
  throw NotFound(fmt::format("there is no job '{}'{}", name, did_you_mean(name, names)));
}

int FarmQueries::num_made_since(std::int64_t shot_id, std::int64_t wall_ms) {
  return static_cast<int>(
      db_.integer_or(0,
                     "SELECT count(DISTINCT job_id) FROM attempt JOIN job ON job.id = job_id WHERE shot_id = ? "
                     "AND outcome = 'done' AND leased_ms >= ?",
                     shot_id, wall_ms));
}

ReportInput FarmQueries::report_input(std::int64_t shot_id, std::int64_t now_ms) {
  ReportInput input;
  input.shot = read_shot(shot_folder(shot_id), kind_names());
  input.kinds = kind_names();
  input.now_ms = now_ms;
  {
    auto row = db_.query("SELECT state, error, submitted_ms, finished_ms FROM shot WHERE id = ?", shot_id);
    check(row.step(), "the shot's folder was found a moment ago");
    input.state = row.text(0);
    input.error = row.text(1);
    input.submitted_ms = row.integer(2);
    if (!row.is_null(3)) input.finished_ms = row.integer(3);
  }
  for (auto row = db_.query(
           "SELECT job.name, kind, job.state, key, error_kind, job.error, wall_ms, peak_rss_mb, coalesce((SELECT "
           "log_path "
           "FROM "
           "attempt WHERE job_id = job.id ORDER BY number DESC LIMIT 1), '') FROM job JOIN shot ON shot.id = shot_id "
           "WHERE shot_id = ? AND job.generation = shot.generation ORDER BY job.id",
           shot_id);
       row.step();) {
    ReportJob job{.name = row.text(0),
                  .kind = row.text(1),
                  .state = row.text(2),
                  .artifact = {},
                  .error_kind = row.text(4),
                  .error = row.text(5),
                  .log_path = row.text(8),
                  .wall_ms = row.integer(6),
                  .peak_rss_mb = static_cast<int>(row.integer(7))};
    if (job.state == "done" || job.state == "skipped")
      job.artifact = result_folder(input.shot.folder, job.kind, row.text(3));
    input.jobs.push_back(std::move(job));
  }
  return input;
}

std::string FarmQueries::reproduce_command(std::int64_t job_id) {
  auto row = db_.query("SELECT folder, job.name FROM job JOIN shot ON shot.id = shot_id WHERE job.id = ?", job_id);
  if (!row.step()) return {};
  const fs::path spec = fs::path(row.text(0)) / ".vantage" / "specs" / (row.text(1) + ".json");
  return fs::exists(spec) ? fmt::format("vantage-worker exec '{}'", spec.string()) : "";
}

}  // namespace vantage

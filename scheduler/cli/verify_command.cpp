// vantage verify: are a shot's results what was computed, and would they be computed so again?
#include <fmt/format.h>

#include <algorithm>
#include <random>

#include "scheduler/cli/commands.h"
#include "scheduler/cli/parse.h"
#include "scheduler/cli/programs.h"
#include "scheduler/upkeep/reach.h"
#include "scheduler/upkeep/verify.h"
#include "schema/base/error.h"
#include "schema/base/json.h"
#include "schema/formats/manifest.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

struct VerifyOptions {
  fs::path shot, state_dir;
  int num_sample = 5;
  bool all = false, recompute = false, repair = false, json = false;
};

VerifyOptions parse_options(const Arguments& arguments) {
  CLI::App app{
      "Reads all results of a shot and compares them with their manifests; with --recompute makes some of them again, "
      "beside the store, and compares what comes out. Exit code 1 when something differs.",
      "vantage verify"};
  VerifyOptions options;
  app.add_option("shot", options.shot, "folder of the shot")->required();
  app.add_option("--state", options.state_dir, "folder of the farm; left out: that of 'vantage run'");
  app.add_flag("--recompute", options.recompute, "make a random sample again");
  app.add_option("--sample", options.num_sample, "how many")->check(CLI::Range(1, 1'000'000))->capture_default_str();
  app.add_flag("--all", options.all, "make all again instead of a sample");
  app.add_flag("--repair", options.repair, "move damaged results aside, so that the next run makes them again");
  app.add_flag("--json", options.json, "for programs");
  parse(app, arguments);
  options.recompute = options.recompute || options.all;
  options.shot = fs::absolute(options.shot).lexically_normal();
  if (options.shot.filename().empty()) options.shot = options.shot.parent_path();
  if (options.state_dir.empty()) options.state_dir = options.shot / ".vantage" / "farm";
  return options;
}

struct Row {
  std::string check, job, verdict, text;
  bool good = true;
};

/// Reads everything; what is damaged is also put into `damaged`.
std::vector<Row> hash_all(const std::vector<PlannedArtifact>& artifacts, const fs::path& store,
                          std::vector<PlannedArtifact>& damaged) {
  std::vector<Row> rows;
  for (const PlannedArtifact& artifact : artifacts) {
    const std::string why = why_damaged(artifact_folder(store, artifact.kind, artifact.key), artifact.content);
    if (why.empty()) continue;
    damaged.push_back(artifact);
    rows.push_back({"hashes", artifact.job, "damaged", why, false});
  }
  return rows;
}

std::vector<PlannedArtifact> sample_of(const std::vector<PlannedArtifact>& artifacts, const VerifyOptions& options) {
  if (options.all) return artifacts;
  std::vector<PlannedArtifact> sample;
  std::sample(artifacts.begin(), artifacts.end(), std::back_inserter(sample), options.num_sample,
              std::mt19937(std::random_device{}()));
  return sample;
}

Row recompute_one(Sqlite& db, const PlannedArtifact& artifact, const VerifyOptions& options) {
  using enum Recomputed::Verdict;
  const Recomputed done = recompute(db, artifact, options.shot, sibling_program("vantage-worker"));
  const std::string took = fmt::format("{:.1f} s", done.wall_s);
  if (done.verdict == Same) return {"recompute", artifact.job, "same", took, true};
  if (done.verdict == Failed) return {"recompute", artifact.job, "failed", done.text, false};
  return {"recompute", artifact.job, "differs",
          fmt::format("content {}, in the store {}; {}", done.text, artifact.content, took), false};
}

void print(const std::vector<Row>& rows, std::size_t num_read) {
  for (const Row& row : rows) fmt::print("{:<10} {:<8} {:<40} {}\n", row.check, row.verdict, row.job, row.text);
  const auto num_bad = std::count_if(rows.begin(), rows.end(), [](const Row& row) { return !row.good; });
  fmt::print("{} results read, {} made again, {} bad.\n", num_read,
             std::count_if(rows.begin(), rows.end(), [](const Row& row) { return row.check == "recompute"; }), num_bad);
}

Json to_json(const std::vector<Row>& rows, std::size_t num_read) {
  Json list = Json::array();
  for (const Row& row : rows)
    list.push_back({{"check", row.check}, {"job", row.job}, {"verdict", row.verdict}, {"text", row.text}});
  return {{"num_read", num_read}, {"rows", list}};
}

void say_how_to_mend(const VerifyOptions& options, const std::vector<PlannedArtifact>& damaged) {
  if (damaged.empty()) return;
  const bool local = options.state_dir == options.shot / ".vantage" / "farm";
  const std::string again = local ? fmt::format("vantage run '{}'", options.shot.string())
                                  : fmt::format("vantage submit '{}' --server URL", options.shot.string());
  if (options.repair)
    fmt::print("Moved aside. Now make them again, and all that was made from them if it differs: {}\n", again);
  else
    fmt::print("To mend: vantage verify '{}'{} --repair, then: {}\n", options.shot.string(),
               local ? "" : fmt::format(" --state '{}'", options.state_dir.string()), again);
}

}  // namespace

int verify_command(const Arguments& arguments) {
  const VerifyOptions options = parse_options(arguments);
  const fs::path store = store_of(options.shot);
  Sqlite db = open_farm_to_read(options.state_dir);
  const auto artifacts = finished_artifacts(db, options.shot);
  std::vector<PlannedArtifact> damaged;
  std::vector<Row> rows = hash_all(artifacts, store, damaged);
  if (options.repair)
    for (const PlannedArtifact& artifact : damaged) move_damaged_aside(store, artifact);
  if (options.recompute)
    for (const PlannedArtifact& artifact : sample_of(artifacts, options))
      rows.push_back(recompute_one(db, artifact, options));
  if (options.json)
    fmt::print("{}\n", to_json(rows, artifacts.size()).dump());
  else
    print(rows, artifacts.size()), say_how_to_mend(options, damaged);
  const bool all_good = std::all_of(rows.begin(), rows.end(), [](const Row& row) { return row.good; });
  return all_good ? kExitOk : kExitFailed;
}

}  // namespace vantage

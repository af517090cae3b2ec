#pragma once
/// Kinds of jobs that take milliseconds and need no footage, for tests of the farm itself. A shot of them is a
/// shot.toml with two cameras that nobody opens and a table for each kind.
#include "jobs/job_context.h"
#include "jobs/kind_entry.h"

namespace vantage {

/// Bytes that follow from the job's number and the salt alone.
struct SeedJob {
  struct Params {
    int num_jobs = 0;
    int num_bytes = 200;
    int pause_ms = 0;
    std::string salt;
    void fields(auto&& field) {
      field("num_jobs", num_jobs, Range{0, 1e6}, "how many");
      field("num_bytes", num_bytes, Range{1, 1e9}, "size of each output");
      field("pause_ms", pause_ms, Range{0, 1e6}, "how long each takes besides");
      field("salt", salt, Any{}, "what the bytes follow from, besides the number");
    }
  };
  static KindSpec spec() { return {.name = "seed", .version = 1, .reads = "nothing", .publishes = "bytes"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

/// Bytes that follow from those of two seeds.
struct MixJob {
  struct Params {
    int num_jobs = 0;
    int pause_ms = 0;
    void fields(auto&& field) {
      field("num_jobs", num_jobs, Range{0, 1e6}, "how many");
      field("pause_ms", pause_ms, Range{0, 1e6}, "how long each takes besides");
    }
  };
  static KindSpec spec() { return {.name = "mix", .version = 1, .reads = "two seeds", .publishes = "bytes"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

/// Bytes that follow from those of many mixes. Planned only when the first seed is done, as kinds of the pipeline are.
struct JoinJob {
  struct Params {
    int num_jobs = 0;
    void fields(auto&& field) { field("num_jobs", num_jobs, Range{0, 1e5}, "how many: each takes its share of mixes"); }
  };
  static KindSpec spec() { return {.name = "join", .version = 1, .reads = "mixes", .publishes = "bytes"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

/// Nothing at all, within the worker and without a result: as many as one likes.
struct BlipJob {
  struct Params {
    int num_jobs = 0;
    void fields(auto&& field) { field("num_jobs", num_jobs, Range{0, 1e6}, "how many"); }
  };
  static KindSpec spec() {
    return {.name = "blip", .version = 1, .reads = "nothing", .publishes = "", .in_worker = true};
  }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

/// Needs the program vantage-short-tool, which a test puts on the PATH of some workers.
struct ToolJob {
  struct Params {
    int num_jobs = 0;
    void fields(auto&& field) { field("num_jobs", num_jobs, Range{0, 1e5}, "how many"); }
  };
  static KindSpec spec() {
    return {.name = "tool", .version = 1, .reads = "nothing", .publishes = "bytes", .programs = "vantage-short-tool"};
  }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

/// Jobs that misbehave: as many of each sort as its option says, named "trouble/SORT-0" and so on.
struct TroubleJob {
  struct Params {
    int crash = 0, hang = 0, busy = 0, hog = 0, chatter = 0, flaky = 0, slow = 0, bad = 0;
    int hog_mb = 512, chatter_mb = 1024, num_failures = 2, slow_ms = 1000;
    int ram_mb = 64, timeout_s = 3600;
    std::string memory_dir;
    void fields(auto&& field) {
      constexpr Range kMany{0, 1e5};
      field("crash", crash, kMany, "abort, always");
      field("hang", hang, kMany, "never end and do nothing");
      field("busy", busy, kMany, "never end and use a core");
      field("hog", hog, kMany, "allocate and touch hog_mb");
      field("chatter", chatter, kMany, "write chatter_mb to the log, then succeed");
      field("flaky", flaky, kMany, "fail num_failures times for a passing reason, then succeed");
      field("slow", slow, kMany, "take slow_ms, then succeed");
      field("bad", bad, kMany, "complain of bad input");
      field("hog_mb", hog_mb, Range{1, 1e6}, "memory of a hog");
      field("chatter_mb", chatter_mb, Range{1, 1e5}, "log of a chatter");
      field("num_failures", num_failures, Range{0, 100}, "of a flaky one");
      field("slow_ms", slow_ms, Range{0, 1e7}, "time of a slow one");
      field("ram_mb", ram_mb, Range{1, 1e6}, "memory that each reserves");
      field("timeout_s", timeout_s, Range{1, 1e6}, "time that each may take");
      field("memory_dir", memory_dir, Any{}, "where flaky ones count their failures");
    }
  };
  static KindSpec spec() { return {.name = "trouble", .version = 1, .reads = "nothing", .publishes = "bytes"}; }
  static std::vector<WorkUnit> split(const ShotState& state, const Params& params);
  static void run(JobContext& context, const Params& params);
};

const std::vector<KindEntry>& short_kinds();

}  // namespace vantage

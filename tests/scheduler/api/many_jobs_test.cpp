// Lists of a farm with very many jobs: a page costs the same wherever it lies.
#include <algorithm>
#include <chrono>

#include "scheduler/api/queries.h"
#include "tests/scheduler/api/api_server.h"

namespace vantage {
namespace {

constexpr int kNumJobs = 200'000;
constexpr double kMaxPage_ms = 100;

class ManyJobs : public ApiServer {
 protected:
  ManyJobs() {
    farm_.db().script("BEGIN");
    farm_.db().run(
        "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n WHERE i < ?) INSERT INTO job (shot_id, name, "
        "kind, stage, version, generation, plan_hash, params, unit, sources, links, state, cores, ram_mb, timeout_s, "
        "created_ms) SELECT 1, printf('render/big/%07d', i), 'render', 0, 1, 1, '', '{}', '{}', '[]', '[]', CASE i % "
        "10 WHEN "
        "0 THEN 'failed' WHEN 1 THEN 'ready' ELSE 'done' END, 1, 100, 60, 0 FROM n",
        kNumJobs);
    count_jobs(farm_.db());
    farm_.db().script("COMMIT");
  }
  /// Median of five.
  double page_ms(const std::string& path) {
    std::vector<double> times;
    for (int i = 0; i < 5; ++i) {
      const auto start = std::chrono::steady_clock::now();
      EXPECT_EQ(http_.Get(path)->status, 200) << path;
      times.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count());
    }
    std::sort(times.begin(), times.end());
    return times.at(2);
  }
};

TEST_F(ManyJobs, EveryListAnswersItsFirstPageAtOnce) {
  const std::string jobs = "/api/v1/shots/1/jobs?limit=100";
  for (const std::string& path :
       {std::string("/api/v1/shots"), std::string("/api/v1/shots/1"), jobs, jobs + "&state=failed",
        jobs + "&kind=render", jobs + "&state=done,skipped", jobs + "&text=0012", jobs + "&text=nothing",
        jobs + "&name=render/big/0100000", std::string("/api/v1/audit"), std::string("/api/v1/workers"),
        std::string("/metrics")})
    EXPECT_LT(page_ms(path), kMaxPage_ms) << path;
}

TEST_F(ManyJobs, APageInTheMiddleCostsWhatTheFirstOneDoes) {
  FarmQueries queries(farm_.state_dir());
  std::string after;
  int num = 0;
  for (int page = 0; page < 50; ++page) {
    const Json answer = queries.jobs(1, {.states = "failed", .after = after, .limit = 100});
    num += static_cast<int>(answer.at("jobs").size());
    after = answer.at("after");
  }
  EXPECT_EQ(num, 5000);
  EXPECT_LT(page_ms("/api/v1/shots/1/jobs?limit=100&state=failed&after=" + after), kMaxPage_ms);
}

TEST_F(ManyJobs, ASearchGoesOnUntilAllNamesWereLookedAt) {
  FarmQueries queries(farm_.state_dir());
  Json page = queries.jobs(1, {.text = "0199999"});
  int num_pages = 1;
  for (; page.at("jobs").empty() && !page.at("after").is_null(); ++num_pages)
    page = queries.jobs(1, {.text = "0199999", .after = page.at("after")});
  ASSERT_EQ(page.at("jobs").size(), 1u);
  EXPECT_LE(num_pages, 12);
}

}  // namespace
}  // namespace vantage

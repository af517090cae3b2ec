// /metrics: the farm as Prometheus sees it. The number of series depends on the number of stages, never on that of
// shots, jobs or workers.
#include <sys/resource.h>
#include <unistd.h>

#include <fstream>

#include "scheduler/api/handlers.h"
#include "scheduler/api/metrics_text.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

double file_bytes(const fs::path& file) {
  std::error_code none;
  const auto size = fs::file_size(file, none);
  return none ? 0 : static_cast<double>(size);
}

double seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

double resident_bytes() {
  std::ifstream statm("/proc/self/statm");
  double total_pages = 0, resident_pages = 0;
  statm >> total_pages >> resident_pages;
  return resident_pages * static_cast<double>(sysconf(_SC_PAGESIZE));
}

void add_process(MetricsText& out) {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  out.single("process_cpu_seconds_total", "counter", "CPU time of the scheduler, user and system.",
             seconds(usage.ru_utime) + seconds(usage.ru_stime));
  out.single("process_resident_memory_bytes", "gauge", "Memory of the scheduler.", resident_bytes());
}

void add_jobs(MetricsText& out, FarmQueries& queries) {
  out.family("vantage_jobs", "gauge", "Jobs of the shots' present plans, by stage and state.");
  for (const auto& count : queries.counts_of_all())
    out.sample(static_cast<double>(count.num), {{"kind", count.kind}, {"state", count.state}});
  out.family("vantage_shots", "gauge", "Shots by state.");
  for (const auto& [state, num] : queries.num_shots()) out.sample(static_cast<double>(num), {{"state", state}});
  out.family("vantage_workers", "gauge", "Workers by state.");
  for (const auto& [state, num] : queries.num_workers()) out.sample(static_cast<double>(num), {{"state", state}});
}

void add_farm(MetricsText& out, const FarmState& state) {
  const FarmStats& stats = state.stats;
  const auto count = [&](const char* name, const char* help, std::int64_t num) {
    out.single(name, "counter", help, static_cast<double>(num));
  };
  count("vantage_claims_total", "Attempts handed out.", stats.num_claimed);
  out.family("vantage_attempts_ended_total", "counter", "Attempts that ended, by outcome.");
  for (const auto& [outcome, num] : stats.num_ended) out.sample(static_cast<double>(num), {{"outcome", outcome}});
  count("vantage_reports_total", "Reports of workers that were taken in.", stats.num_reports);
  out.single("vantage_waiting_reports", "gauge", "Reports that wait for the scheduler's thread.",
             static_cast<double>(stats.num_waiting_reports));
  count("vantage_scheduler_turns_total", "Turns of the scheduler's thread, one transaction each.", stats.num_turns);
  count("vantage_scheduler_stalls_total", "Times that the scheduler's thread stood still for a second or longer.",
        stats.num_stalls);
  count("vantage_scheduler_starts_total", "Starts of the scheduler on this database.", stats.epoch);
  out.single("vantage_scheduler_thread_cpu_seconds_total", "counter", "CPU time of the scheduler's thread.",
             1e-3 * static_cast<double>(stats.cpu_ms));
  out.histogram("vantage_turn_duration_seconds", "Time to decide and to make it durable.", stats.turn_s, kTurnSeconds);
  out.single("vantage_scheduler_healthy", "gauge", "0 while something keeps the farm from working; see /api/v1/health.",
             state.health.trouble.empty() ? 1 : 0);
}

void add_bus(MetricsText& out, const FarmState& state) {
  const DropCounts& d = state.drops;
  out.family("vantage_messages_dropped_total", "counter", "Messages that were not believed, by reason.");
  for (const auto& [reason, num] : {std::pair{"malformed", d.malformed},
                                    {"version", d.version},
                                    {"foreign", d.foreign},
                                    {"bad_mac", d.bad_mac},
                                    {"older", d.older},
                                    {"queue_full", d.queue_full}})
    out.sample(static_cast<double>(num), {{"reason", reason}});
  if (!state.broker) return;
  out.single("vantage_broker_clients", "gauge", "Connections to the own broker.",
             static_cast<double>(state.broker->num_clients));
  out.single("vantage_broker_relayed_total", "counter", "Messages that the own broker passed on.",
             static_cast<double>(state.broker->num_relayed));
  out.single("vantage_broker_dropped_total", "counter",
             "Messages that a client of the own broker did not fetch in time.",
             static_cast<double>(state.broker->num_dropped));
}

void add_database(MetricsText& out, const fs::path& state_dir) {
  const fs::path file = state_dir / "farm.sqlite";
  out.single("vantage_database_bytes", "gauge", "Size of the database file.", file_bytes(file));
  out.single("vantage_database_wal_bytes", "gauge", "Size of the database's write-ahead log.",
             file_bytes(file.string() + "-wal"));
}

void add_http(MetricsText& out, const HttpCounts& counts, const LimitedServer& server, int num_streams) {
  out.family("vantage_http_requests_total", "counter", "Requests by route and status.");
  for (const auto& [key, num] : counts.numbers())
    out.sample(static_cast<double>(num), {{"route", key.first}, {"status", std::to_string(key.second)}});
  out.histogram("vantage_http_request_duration_seconds", "Time to make an answer, sending it aside.", counts.took(),
                kAnswerSeconds);
  out.single("vantage_http_connections", "gauge", "Open connections.", server.num_connections());
  out.single("vantage_http_event_streams", "gauge", "Open event streams.", num_streams);
  out.family("vantage_http_refused_total", "counter", "Connections turned away before their request was looked at.");
  for (std::size_t i = 0; i < kRefusalNames.size(); ++i)
    out.sample(static_cast<double>(server.num_refused(static_cast<Refusal>(i))), {{"reason", kRefusalNames.at(i)}});
}

}  // namespace

void Handlers::metrics(const Call&, httplib::Response& res) {
  MetricsText out;
  FarmQueries queries(context_.state_dir);
  add_jobs(out, queries);
  const FarmState state = context_.control.state();
  add_farm(out, state);
  add_bus(out, state);
  add_database(out, context_.state_dir);
  add_process(out);
  add_http(out, *context_.counts, *context_.server, num_streams_);
  res.set_content(out.text(), "text/plain; version=0.0.4; charset=utf-8");
}

}  // namespace vantage

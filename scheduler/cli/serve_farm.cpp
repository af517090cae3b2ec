#include "scheduler/cli/serve_farm.h"

#include <fmt/format.h>

#include <chrono>
#include <functional>
#include <future>
#include <thread>

#include "scheduler/api/http_server.h"
#include "scheduler/cli/parse.h"
#include "scheduler/cli/report_keeper.h"
#include "scheduler/cli/stop_signal.h"
#include "scheduler/farm/farm.h"
#include "scheduler/farm/farm_config.h"
#include "scheduler/upkeep/upkeep.h"
#include "schema/base/log_file.h"

namespace vantage {
namespace {

constexpr auto kBeat = std::chrono::milliseconds(200);

}  // namespace

ServeOptions parse_serve_options(const Arguments& arguments) {
  CLI::App app{"Serves a farm until it is stopped. Killed at any moment, it goes on where it was when started again.",
               "vantage scheduler"};
  ServeOptions options;
  app.add_option("--state", options.state_dir, "folder of the farm's database, key and farm.toml")->required();
  std::vector<std::function<void(const FarmConfig&)>> from_file;
  const auto add = [&](const char* name, auto& value, const char* meaning, auto take) {
    CLI::Option* option = app.add_option(name, value, meaning)->capture_default_str();
    from_file.emplace_back([option, &value, take](const FarmConfig& config) {
      if (option->count() == 0) value = take(config.server);
    });
    return option;
  };
  using Server = FarmConfig::Server;
  add("--listen", options.listen, "address of page and API", [](const Server& s) { return s.listen; });
  add("--bus", options.bus,
      "LCM URL that workers use, e.g. udpm://239.255.76.67:7667?ttl=1; left out: an own broker over TCP",
      [](const Server& s) { return s.bus; });
  add("--bus-listen", options.bus_listen, "address of the own broker", [](const Server& s) { return s.bus_listen; });
  add("--bus-port", options.bus_port, "its port, the same at every start, so that workers find it again",
      [](const Server& s) { return s.bus_port; })
      ->check(CLI::Range(0, 65535));
  add("--lease-ms", options.lease_ms, "a worker that is not heard of for so long has lost its jobs",
      [](const Server& s) { return s.lease_s * 1000; })
      ->check(CLI::Range(100, 3'600'000));
  app.footer("What is not given is taken from STATE/farm.toml, which 'vantage farm init' writes.");
  parse(app, arguments);
  const FarmConfig config = read_farm_config(options.state_dir);
  for (const auto& take : from_file) take(config);
  return options;
}

int serve_farm(const ServeOptions& options, const std::vector<KindEntry>& kinds) {
  note_stop_signals();
  const FarmConfig config = read_farm_config(options.state_dir);
  also_log_to(std::filesystem::path(options.state_dir) / "scheduler.log", config.logs.max_mb, config.logs.keep_files);
  FarmScheduler farm({.state_dir = options.state_dir,
                      .bus_url = options.bus,
                      .listen = options.bus_listen,
                      .broker_port = options.bus_port,
                      .http_address = "",
                      .lease_ms = options.lease_ms,
                      .kinds = &kinds});
  HttpServer server({.listen = options.listen, .state_dir = farm.state_dir(), .control = control_of(farm)});
  farm.set_http_address(server.url());
  fmt::print("Page: {}\nAPI: {}\nWorkers: vantage-worker --bus '{}' --farm-key '{}' --state FOLDER --slots N\n",
             server.page_url(), server.url(), farm.bus_url(), farm.key_file().string());
  std::fflush(stdout);
  const Upkeep upkeep({.state_dir = farm.state_dir(),
                       .config = config,
                       .note = [&](const std::string& kind, const std::string& text) { farm.note(kind, text); }});
  ReportKeeper reports(farm.state_dir(), system_clock());
  while (!stop_was_asked()) {
    for (const auto& sentence : reports.keep(farm.all_progress())) fmt::print(stderr, "vantage: {}\n", sentence);
    std::this_thread::sleep_for(kBeat);
  }
  fmt::print("Stopped. Work goes on when the scheduler is started again.\n");
  return kExitOk;
}

}  // namespace vantage

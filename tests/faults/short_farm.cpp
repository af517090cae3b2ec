#include "tests/faults/short_farm.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <httplib.h>
#include <netinet/in.h>
#include <signal.h>
#include <sys/socket.h>
#include <unistd.h>

#include <random>
#include <sstream>

#include "schema/base/error.h"
#include "schema/base/files.h"
#include "tests/support/network.h"

namespace vantage::faults {
namespace fs = std::filesystem;
namespace {

const std::string kBin = VANTAGE_BIN;
constexpr double kStartPatience_s = 20;

/// Below those that the system hands out by itself, so that nobody takes it between our looking and our using it.
int free_port() {
  static std::mt19937 random{std::random_device{}()};
  for (;;) {
    const int port = std::uniform_int_distribution(15'000, 32'000)(random);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int fd = socket(AF_INET, SOCK_STREAM, 0);
    const bool is_free = bind(fd, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
    close(fd);
    if (is_free) return port;
  }
}

std::string read_if_there(const fs::path& file) { return fs::exists(file) ? read_file(file) : ""; }

}  // namespace

void write_short_shot(const fs::path& shot, const std::string& tables) {
  fs::create_directories(shot);
  std::string text;
  for (const char* camera : {"left", "right"})
    text += fmt::format("[[camera]]\nname = \"{0}\"\nfootage = \"{0}.mp4\"\n", camera);
  write_file_atomically(shot / "shot.toml", text + tables);
}

std::vector<std::string> at_place(const Place& place, const std::vector<std::string>& argv) {
  std::vector<std::string> all;
  if (!place.netns.empty()) all.insert(all.end(), {"ip", "netns", "exec", place.netns});
  if (!place.environment.empty()) {
    all.push_back("env");
    all.insert(all.end(), place.environment.begin(), place.environment.end());
  }
  all.insert(all.end(), argv.begin(), argv.end());
  return all;
}

ShortFarm::ShortFarm(fs::path folder, Settings settings)
    : folder_(std::move(folder)), settings_(std::move(settings)), http_port_(free_port()), bus_port_(free_port()) {
  fs::create_directories(state());
}

void ShortFarm::launch() {
  std::vector<std::string> argv{kBin + "/vantage-short-farm",
                                "--state",
                                state(),
                                "--lease-ms",
                                std::to_string(settings_.lease_ms),
                                "--listen",
                                fmt::format("127.0.0.1:{}", http_port_)};
  if (settings_.bus.empty())
    argv.insert(argv.end(), {"--bus-listen", settings_.bus_listen, "--bus-port", std::to_string(bus_port_)});
  else
    argv.insert(argv.end(), {"--bus", settings_.bus});
  scheduler_.reset();
  scheduler_ = std::make_unique<Running>(at_place(settings_.place, argv), folder_ / "scheduler.txt");
}

void ShortFarm::start() {
  launch();
  const bool answers =
      wait_until([&] { return scheduler_->ended() || try_get("/api/v1/shots").has_value(); }, kStartPatience_s);
  check(answers && !scheduler_->ended(), "the scheduler starts; it printed: " + printed());
}

void ShortFarm::kill() {
  ::kill(scheduler_->pid(), SIGKILL);
  scheduler_->wait();
}

std::optional<std::string> ShortFarm::try_get(const std::string& path) {
  std::optional<std::string> answer;
  in_netns(settings_.place.netns, [&] {
    httplib::Client http("127.0.0.1", http_port_);
    http.set_read_timeout(10);
    if (const auto result = http.Get(path); result && result->status == 200) answer = result->body;
  });
  return answer;
}

Json ShortFarm::get(const std::string& path) {
  const auto answer = try_get("/api/v1" + path);
  check(answer.has_value(), "the scheduler answers " + path);
  return Json::parse(*answer);
}

double ShortFarm::metric(const std::string& name) {
  std::istringstream lines(try_get("/metrics").value_or(""));
  for (std::string line; std::getline(lines, line);)
    if (line.starts_with(name + " ")) return std::stod(line.substr(name.size() + 1));
  return 0;
}

Json ShortFarm::post(const std::string& path, const Json& body) {
  Json answer;
  in_netns(settings_.place.netns, [&] {
    httplib::Client http("127.0.0.1", http_port_);
    http.set_read_timeout(60);
    httplib::Headers headers;
    if (std::string token = read_if_there(state() / "operator.token"); !token.empty())
      headers.emplace("Authorization", "Bearer " + token.substr(0, token.find('\n')));
    const auto result = http.Post("/api/v1" + path, headers, body.dump(), "application/json");
    check(static_cast<bool>(result), "the scheduler answers " + path);
    check(result->status == 200, path + ": " + result->body);
    answer = Json::parse(result->body);
  });
  return answer;
}

std::int64_t ShortFarm::submit(const fs::path& shot) { return post("/shots", {{"folder", shot.string()}}).at("shot"); }

std::string ShortFarm::ask(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), kBin + "/vantage");
  arguments.insert(arguments.end(), {"--server", url()});
  if (fs::exists(state() / "operator.token"))
    arguments.insert(arguments.end(), {"--token-file", (state() / "operator.token").string()});
  return run(at_place(settings_.place, arguments)).output;
}

std::string ShortFarm::printed() const { return read_if_there(folder_ / "scheduler.txt"); }

std::string ShortFarm::bus() const {
  return settings_.bus.empty() ? fmt::format("tcpq://{}:{}", settings_.bus_listen, bus_port_) : settings_.bus;
}

std::string ShortFarm::url() const { return fmt::format("http://127.0.0.1:{}", http_port_); }

ShortWorker::ShortWorker(ShortFarm& farm, const std::string& name, Settings settings)
    : farm_(farm), name_(name), settings_(std::move(settings)) {
  start();
}

void ShortWorker::start() {
  const std::string program = settings_.program.empty() ? kBin + "/vantage-short-worker" : settings_.program;
  const std::vector<std::string> argv{program,
                                      "--bus",
                                      settings_.bus.empty() ? farm_.bus() : settings_.bus,
                                      "--farm-key",
                                      farm_.state() / "farm.key",
                                      "--state",
                                      state(),
                                      "--slots",
                                      std::to_string(settings_.slots),
                                      "--cores",
                                      std::to_string(settings_.slots),
                                      "--ram-mb",
                                      std::to_string(settings_.ram_mb)};
  process_.reset();
  process_ = std::make_unique<Running>(at_place(settings_.place, argv), farm_.folder() / (name_ + ".txt"));
}

void ShortWorker::signal(int number) { ::kill(pid(), number); }

void ShortWorker::kill() {
  signal(SIGKILL);
  process_->wait();
}

std::string ShortWorker::printed() const { return read_if_there(farm_.folder() / (name_ + ".txt")); }

std::string ShortWorker::id() const { return read_json(state() / "worker.json").at("id"); }

}  // namespace vantage::faults

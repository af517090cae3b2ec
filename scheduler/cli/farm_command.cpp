// vantage farm: set up a farm's state folder, give out tokens.
#include <fmt/format.h>
#include <unistd.h>

#include <array>

#include "scheduler/cli/commands.h"
#include "scheduler/cli/parse.h"
#include "scheduler/farm/farm_config.h"
#include "scheduler/farm/lock_file.h"
#include "scheduler/store/store.h"
#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/messages/farm.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

struct InitOptions {
  fs::path state_dir;
  FarmConfig::Server server;
  bool json = false;
};

InitOptions parse_init(const Arguments& arguments) {
  CLI::App app{"Makes the state folder of a farm: key, farm.toml, database and two tokens.", "vantage farm init"};
  InitOptions options;
  app.add_option("state", options.state_dir, "folder to make, on a disk of this machine")->required();
  app.add_option("--listen", options.server.listen, "address of page and API")->capture_default_str();
  app.add_option("--bus", options.server.bus, "LCM URL that workers use; left out: an own broker over TCP");
  app.add_option("--bus-listen", options.server.bus_listen, "address of the own broker")->capture_default_str();
  app.add_option("--bus-port", options.server.bus_port, "its port")->check(CLI::Range(0, 65535))->capture_default_str();
  app.add_flag("--json", options.json, "for programs");
  parse(app, arguments);
  return options;
}

void refuse_to_overwrite(const fs::path& state_dir) {
  for (const char* name : {"farm.toml", "farm.key", "farm.sqlite"})
    if (fs::exists(state_dir / name))
      throw Error(ErrorKind::BadInput,
                  fmt::format("{}: a farm is here already ({}); start it with 'vantage scheduler --state {}'",
                              state_dir.string(), name, state_dir.string()));
}

std::string name_of_this_host() {
  std::array<char, 256> name{};
  gethostname(name.data(), name.size() - 1);
  return name.data();
}

/// What workers are told: a broker that listens everywhere is reached by the machine's name.
std::string bus_of(const FarmConfig::Server& server) {
  if (!server.bus.empty()) return server.bus;
  const std::string host = server.bus_listen == "0.0.0.0" ? name_of_this_host() : server.bus_listen;
  return fmt::format("tcpq://{}:{}", host, server.bus_port);
}

/// Makes everything; returns the secrets of operator and viewer, which are kept nowhere.
std::pair<NewToken, NewToken> make_farm(const InitOptions& options) {
  std::error_code error;
  fs::create_directories(options.state_dir, error);
  if (error)
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: cannot be made: {}", options.state_dir.string(), error.message()));
  refuse_to_overwrite(options.state_dir);
  const LockFile lock(options.state_dir / "lock");
  read_or_create_farm_key(options.state_dir / "farm.key");
  const NewToken operate = new_token("operator", "operate"), read = new_token("viewer", "read");
  write_farm_config(options.state_dir, options.server, {operate.entry, read.entry});
  const Store store(options.state_dir / "farm.sqlite", system_clock());
  return {operate, read};
}

int init_farm(const Arguments& arguments) {
  InitOptions options = parse_init(arguments);
  options.state_dir = fs::absolute(options.state_dir).lexically_normal();
  const auto [operate, read] = make_farm(options);
  const std::string state = options.state_dir.string();
  const std::string scheduler = fmt::format("vantage scheduler --state '{}'", state);
  const std::string worker = fmt::format("vantage-worker --bus '{}' --farm-key '{}/farm.key' --state FOLDER --slots N",
                                         bus_of(options.server), state);
  if (options.json) {
    fmt::print("{}\n", Json{{"state", state},
                            {"operate_token", operate.text},
                            {"read_token", read.text},
                            {"scheduler", scheduler},
                            {"worker", worker}}
                           .dump());
    return kExitOk;
  }
  fmt::print(
      "Made {}: farm.toml, farm.key, farm.sqlite.\n\n"
      "Tokens, shown this once (VANTAGE_TOKEN=… for commands):\n  operate  {}\n  read     {}\n\n"
      "Now start the scheduler:\n  {}\nand a worker on each machine that has a copy of farm.key:\n  {}\n",
      state, operate.text, read.text, scheduler, worker);
  return kExitOk;
}

int token_command(const Arguments& arguments) {
  CLI::App app{"Gives out tokens for the API, lists them, takes them back. A running scheduler heeds it at once.",
               "vantage farm token"};
  std::string verb, name, role = "read";
  fs::path state_dir;
  bool json = false;
  app.add_option("verb", verb, "add, list or remove")->required()->check(CLI::IsMember({"add", "list", "remove"}));
  app.add_option("name", name, "of the person or program that gets it");
  app.add_option("--state", state_dir, "folder of the farm")->required();
  app.add_option("--role", role, "read or operate")->check(CLI::IsMember({"read", "operate"}))->capture_default_str();
  app.add_flag("--json", json, "for programs");
  parse(app, arguments);
  if (verb != "list" && name.empty())
    throw Error(ErrorKind::BadInput, fmt::format("vantage farm token {}: needs a name", verb));
  if (!fs::is_directory(state_dir))
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: no such folder; 'vantage farm init' makes a farm", state_dir.string()));
  if (verb == "add") {
    const NewToken token = new_token(name, role);
    add_token(state_dir, token.entry);
    if (json)
      fmt::print("{}\n", Json{{"name", name}, {"role", role}, {"token", token.text}}.dump());
    else
      fmt::print("{}\n", token.text);
  } else if (verb == "remove") {
    remove_token(state_dir, name);
    fmt::print("{}\n", json ? Json{{"removed", name}}.dump() : fmt::format("Removed the token of {}.", name));
  } else {
    Json list = Json::array();
    for (const auto& token : read_farm_config(state_dir).tokens) {
      list.push_back({{"name", token.name}, {"role", token.role}});
      if (!json) fmt::print("{:<20} {}\n", token.name, token.role);
    }
    if (json) fmt::print("{}\n", list.dump());
  }
  return kExitOk;
}

}  // namespace

int farm_command(const Arguments& arguments) {
  const std::string verb = arguments.empty() ? "" : arguments[0];
  const Arguments rest(arguments.begin() + (arguments.empty() ? 0 : 1), arguments.end());
  if (verb == "init") return init_farm(rest);
  if (verb == "token") return token_command(rest);
  if (verb == "--help" || verb == "-h") {
    fmt::print(
        "vantage farm init STATE        make a farm's folder\nvantage farm token add|list|remove --state STATE\n");
    return kExitOk;
  }
  throw Error(ErrorKind::BadInput, fmt::format("vantage farm '{}': expected init or token{}", verb,
                                               did_you_mean(verb, std::vector<std::string>{"init", "token"})));
}

}  // namespace vantage

#pragma once
/// STATE/farm.toml: how a farm is set up. Every setting is written once, in fields(); a file that is absent, or a
/// setting that is, means the default. Options of the command line win.
#include <filesystem>
#include <string>
#include <vector>

#include "schema/shot/params.h"

namespace vantage {

/// What a [[notify]] may wait for.
const std::vector<std::string>& notify_events();

struct FarmConfig {
  /// [farm]
  struct Server {
    std::string listen = "127.0.0.1:8080";
    std::string bus;
    std::string bus_listen = "127.0.0.1";
    int bus_port = 7700;
    int lease_s = 15;
    int low_disk_mb = 2000;
    void fields(auto&& field) {
      field("listen", listen, Any{}, "address and port of page and API");
      field("bus", bus, Any{}, "LCM URL that workers use; empty: an own broker over TCP");
      field("bus_listen", bus_listen, Any{}, "address of the own broker");
      field("bus_port", bus_port, Range{0, 65535}, "its port, the same at every start, so that workers find it again");
      field("lease_s", lease_s, Range{1, 3600}, "a worker that is silent for so long loses its jobs to others");
      field("low_disk_mb", low_disk_mb, Range{0, 1e9},
            "disk_low is told when state folder or store has less; 0: never");
    }
  };
  /// [snapshots]: copies of the database in STATE/snapshots
  struct Snapshots {
    int every_min = 60;
    int keep_hourly = 24;
    int keep_daily = 7;
    void fields(auto&& field) {
      field("every_min", every_min, Range{0, 10080}, "minutes between copies of the database; 0: none");
      field("keep_hourly", keep_hourly, Range{1, 1000}, "copies kept, the newest of each hour");
      field("keep_daily", keep_daily, Range{0, 1000}, "copies kept beyond those, the newest of each day");
    }
  };
  /// [logs]
  struct Logs {
    int max_mb = 20;
    int keep_files = 5;
    int keep_days = 30;
    int attempts_max_mb = 2000;
    void fields(auto&& field) {
      field("max_mb", max_mb, Range{1, 10000}, "size at which the scheduler's and a worker's log start a new file");
      field("keep_files", keep_files, Range{1, 100}, "files kept of each such log");
      field("keep_days", keep_days, Range{1, 3650}, "age at which logs of ended attempts may go");
      field("attempts_max_mb", attempts_max_mb, Range{1, 1e7}, "size of a shot's attempt logs; the oldest go first");
    }
  };
  /// [[token]]: who may ask the API for what. Only the hash of the secret is kept.
  struct Token {
    std::string name;
    std::string role = "read";
    std::string sha256;  ///< of the token's text, 64 hex digits
    void fields(auto&& field) {
      field("name", name, Any{}, "who it was given to: stands in the audit trail");
      field("role", role, OneOf{{"read", "operate"}}, "operate may change things");
      field("sha256", sha256, Any{}, "hash of the token");
    }
    bool may_operate() const { return role == "operate"; }
  };
  /// [[notify]]: what to run or call when something happens.
  struct Notify {
    std::string name;  ///< unique; its place in the trail of events is kept under it
    std::vector<std::string> on;
    std::vector<std::string> command;  ///< argv, run without a shell; the event comes as JSON on its standard input
    std::string webhook;               ///< URL that gets the event as JSON by POST
    int timeout_s = 10;
    int tries = 5;
    void fields(auto&& field) {
      field("name", name, Any{}, "unique name");
      field("on", on, OneOf{notify_events()}, "events");
      field("command", command, Any{}, "program and its arguments; gets the event as JSON on its standard input");
      field("webhook", webhook, Any{}, "http:// or https:// address that gets the event as JSON by POST");
      field("timeout_s", timeout_s, Range{1, 600}, "then it is given up");
      field("tries", tries, Range{1, 100}, "before an event is skipped, with rising pauses between");
    }
  };

  Server server;
  Snapshots snapshots;
  Logs logs;
  std::vector<Token> tokens;
  std::vector<Notify> notify;
};

/// STATE/farm.toml
std::filesystem::path farm_config_file(const std::filesystem::path& state_dir);

/// Reads STATE/farm.toml; defaults when there is none.
/// Throws Error(BadInput) with file and line: TOML errors, unknown tables or keys with a suggestion, values out of
/// range, tokens or hooks with the same name, a hook with neither or both of command and webhook.
FarmConfig read_farm_config(const std::filesystem::path& state_dir);

/// A secret that was just made, and what farm.toml keeps of it.
struct NewToken {
  std::string text;
  FarmConfig::Token entry;
};
NewToken new_token(const std::string& name, const std::string& role);

/// Writes a new farm.toml, readable by its owner only: these server settings and tokens, all other defaults, and what
/// each setting means.
void write_farm_config(const std::filesystem::path& state_dir, const FarmConfig::Server& server,
                       const std::vector<FarmConfig::Token>& tokens);

/// A [[token]] at the end of the file, which is made when missing. Throws Error(BadInput) when the name is taken.
void add_token(const std::filesystem::path& state_dir, const FarmConfig::Token& token);
/// Takes the [[token]] with this name out, all other text stays. Throws Error(BadInput) when there is none.
void remove_token(const std::filesystem::path& state_dir, const std::string& name);

}  // namespace vantage

#pragma once
#include <cstdint>
#include <deque>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "scheduler/farm/farm_config.h"

namespace vantage {

/// What a route asks of its caller, and what a caller may do.
enum class Access { Open, Read, Operate };

/// Everything that a decision rests on.
struct Caller {
  std::string peer_ip{};        ///< who connected
  std::string own_ip{};         ///< the address of ours that they connected to
  std::string host{};           ///< header Host
  std::string authorization{};  ///< header
  std::string session{};        ///< of the cookie
  bool forwarded = false;       ///< came through a proxy: its address says nothing of the caller
};
struct Pass {
  std::string who;  ///< the token's name; "" without one
  Access may = Access::Open;
};
struct Refused {
  int status = 401;  ///< 401 who are you, 403 you may not, 421 not for this server
  std::string why;   ///< one line
};

/// The tokens in force: [[token]] of farm.toml, read again when the file changes; when it has none, the one in
/// STATE/operator.token, which is made at the first start and kept. All members from any thread.
class TokenBook {
 public:
  /// Throws Error(BadInput) for a bad farm.toml, and for an operator.token that others may read.
  explicit TokenBook(std::filesystem::path state_dir);
  /// The token's entry. Compares hashes in constant time.
  std::optional<FarmConfig::Token> find(const std::string& token);
  /// Secret of STATE/operator.token when it is in force, else "".
  std::string operator_token() const { return operator_token_; }

 private:
  void read();
  void read_again_if_changed();

  std::filesystem::path state_dir_;
  std::mutex mutex_;
  std::vector<FarmConfig::Token> tokens_;
  std::filesystem::file_time_type read_of_{};  ///< change time of the farm.toml that tokens_ come from
  std::string operator_token_;
};

/// STATE/operator.token
std::filesystem::path operator_token_file(const std::filesystem::path& state_dir);
/// The one line of a file that holds a token. Throws Error(BadInput) when it cannot be read or others may read it.
std::string read_token_file(const std::filesystem::path& file);

/// Decides who may do what:
/// - reads from this machine are free; all else needs "Authorization: Bearer TOKEN", and writes one that may operate;
/// - a browser shows pictures and films without headers of ours, so that it may exchange its token for a cookie;
/// cookies
///   only read, hence no other page can make the browser command the farm;
/// - a request to a loopback address must name it in Host: a name that an attacker lets point here gets nothing.
/// All members from any thread.
class Gate {
 public:
  /// listen_host: as the person wrote it, a good Host besides localhost.
  Gate(std::filesystem::path state_dir, std::string listen_host);

  std::variant<Pass, Refused> check(const Caller& caller, Access needed);
  /// A new session's secret, for the cookie. The oldest of more than 1000 ends.
  std::string open_session(const Pass& pass);
  std::string operator_token() const { return tokens_.operator_token(); }

 private:
  struct Session {
    std::string secret, who;
  };
  std::optional<Refused> check_host(const Caller& caller) const;
  std::variant<Pass, Refused> identify(const Caller& caller);
  std::optional<Pass> find_session(const std::string& secret);

  TokenBook tokens_;
  std::string listen_host_;
  std::mutex mutex_;
  std::deque<Session> sessions_;
};

}  // namespace vantage

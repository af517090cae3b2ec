#include "scheduler/api/gate.h"

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>

#include "scheduler/api/connection.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr std::string_view kScheme = "Bearer ";
constexpr std::size_t kSecretBytes = 32;
constexpr std::size_t kMaxSessions = 1000;

bool same(std::string_view a, std::string_view b) {
  return a.size() == b.size() && CRYPTO_memcmp(a.data(), b.data(), a.size()) == 0;
}

/// "localhost:8080" -> "localhost", "[::1]:8080" -> "::1"
std::string without_port(const std::string& host) {
  if (host.starts_with('[')) return host.substr(1, host.find(']') - 1);
  return host.substr(0, host.find(':'));
}

std::string read_or_make_operator_token(const fs::path& state_dir) {
  const fs::path file = operator_token_file(state_dir);
  if (!fs::exists(file)) write_file_atomically(file, to_hex(random_bytes(kSecretBytes)) + "\n", 0600);
  return read_token_file(file);
}

fs::file_time_type change_time(const fs::path& file) {
  std::error_code none;
  const auto time = fs::last_write_time(file, none);
  return none ? fs::file_time_type{} : time;
}

}  // namespace

fs::path operator_token_file(const fs::path& state_dir) { return state_dir / "operator.token"; }

std::string read_token_file(const fs::path& file) {
  struct stat info {};
  if (stat(file.c_str(), &info) != 0)
    throw Error(ErrorKind::BadInput, fmt::format("{}: there is no such token file", file.string()));
  if ((info.st_mode & (S_IRWXG | S_IRWXO)) != 0)
    throw Error(ErrorKind::BadInput, fmt::format("{0}: others may read this secret (mode {1:03o}, expected 600); "
                                                 "mend it with: chmod 600 '{0}'",
                                                 file.string(), info.st_mode & 0777U));
  std::string text = read_file(file);
  text.erase(text.find_last_not_of(" \r\n") + 1);
  if (text.empty() || text.find_first_of(" \r\n") != std::string::npos)
    throw Error(ErrorKind::BadInput, fmt::format("{}: expected one line with a token", file.string()));
  return text;
}

TokenBook::TokenBook(fs::path state_dir) : state_dir_(std::move(state_dir)) { read(); }

void TokenBook::read() {
  read_of_ = change_time(farm_config_file(state_dir_));
  tokens_ = read_farm_config(state_dir_).tokens;
  operator_token_ = tokens_.empty() ? read_or_make_operator_token(state_dir_) : "";
  if (!operator_token_.empty()) tokens_ = {{"operator", "operate", sha256_hex(operator_token_)}};
}

void TokenBook::read_again_if_changed() {
  if (change_time(farm_config_file(state_dir_)) == read_of_) return;
  try {
    read();
    spdlog::info("farm.toml: read again, {} tokens", tokens_.size());
  } catch (const Error& e) {  // half written, or wrong: what was good stays in force, and is said once per change
    spdlog::warn("the tokens stay as they were: {}", e.what());
  }
}

std::optional<FarmConfig::Token> TokenBook::find(const std::string& token) {
  const std::string hash = sha256_hex(token);
  const std::lock_guard lock(mutex_);
  read_again_if_changed();
  std::optional<FarmConfig::Token> found;
  for (const auto& known : tokens_)
    if (same(known.sha256, hash)) found = known;
  return found;
}

Gate::Gate(fs::path state_dir, std::string listen_host)
    : tokens_(std::move(state_dir)), listen_host_(std::move(listen_host)) {}

std::optional<Refused> Gate::check_host(const Caller& caller) const {
  if (!is_loopback(caller.own_ip) || caller.forwarded) return std::nullopt;
  const std::string host = without_port(caller.host);
  if (host.empty() || host == "localhost" || host == listen_host_ || is_loopback(host)) return std::nullopt;
  return Refused{421, fmt::format("Host is '{}', but this server is {} or localhost", host, listen_host_)};
}

std::optional<Pass> Gate::find_session(const std::string& secret) {
  const std::lock_guard lock(mutex_);
  for (const auto& session : sessions_)
    if (same(session.secret, secret)) return Pass{session.who, Access::Read};
  return std::nullopt;
}

std::variant<Pass, Refused> Gate::identify(const Caller& caller) {
  if (!caller.authorization.empty()) {
    if (!caller.authorization.starts_with(kScheme)) return Refused{401, "Authorization must be: Bearer TOKEN"};
    const auto token = tokens_.find(caller.authorization.substr(kScheme.size()));
    if (!token) return Refused{401, "no such token"};
    return Pass{token->name, token->may_operate() ? Access::Operate : Access::Read};
  }
  if (!caller.session.empty())
    if (const auto pass = find_session(caller.session)) return *pass;
  const bool here = is_loopback(caller.peer_ip) && !caller.forwarded;
  return Pass{"", here ? Access::Read : Access::Open};
}

std::variant<Pass, Refused> Gate::check(const Caller& caller, Access needed) {
  if (auto refused = check_host(caller)) return *refused;
  if (needed == Access::Open) return Pass{};
  auto known = identify(caller);
  const Pass* pass = std::get_if<Pass>(&known);
  if (pass == nullptr || pass->may >= needed) return known;
  if (pass->who.empty() || caller.authorization.empty())
    return Refused{401,
                   "this needs a token: send 'Authorization: Bearer TOKEN'; the scheduler's state folder holds one "
                   "in operator.token, or farm.toml names who has one"};
  return Refused{403, fmt::format("the token '{}' may only read; this needs one with role = \"operate\"", pass->who)};
}

std::string Gate::open_session(const Pass& pass) {
  const std::lock_guard lock(mutex_);
  sessions_.push_back({to_hex(random_bytes(kSecretBytes)), pass.who});
  if (sessions_.size() > kMaxSessions) sessions_.pop_front();
  return sessions_.back().secret;
}

}  // namespace vantage

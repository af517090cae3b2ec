#include "scheduler/farm/farm_config.h"

#include <algorithm>
#include <regex>
#include <set>
#include <sstream>

#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "schema/base/hash.h"
#include "schema/shot/toml_section.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr unsigned kOwnerOnly = 0600;  // webhooks hold secrets of other services

[[noreturn]] void fail(const Section& s, const std::string& message) {
  throw Error(ErrorKind::BadInput, fmt::format("{}:{}: [[{}]] {}", s.file, s.line, s.name, message));
}

void check_token(const FarmConfig::Token& token, const Section& s) {
  static const std::regex hash("[0-9a-f]{64}"), name("[A-Za-z0-9_.@-]{1,64}");
  if (!std::regex_match(token.name, name))
    fail(s, fmt::format("name '{}': expected 1 to 64 letters, digits and '_', '.', '@', '-'", token.name));
  if (!std::regex_match(token.sha256, hash))
    fail(s, fmt::format("'{}': sha256 is '{}', expected 64 hex digits; 'vantage farm token add' writes it", token.name,
                        token.sha256));
}

void check_notify(const FarmConfig::Notify& hook, const Section& s) {
  if (hook.on.empty()) fail(s, fmt::format("'{}': 'on' names no event", hook.name));
  if (hook.command.empty() == hook.webhook.empty())
    fail(s, fmt::format("'{}': needs either a command or a webhook", hook.name));
  if (!hook.webhook.empty() && !hook.webhook.starts_with("http://") && !hook.webhook.starts_with("https://"))
    fail(s, fmt::format("'{}': webhook is '{}', expected http://… or https://…", hook.name, hook.webhook));
}

class Reader {
 public:
  explicit Reader(const fs::path& file) : file_(file.string()) {}

  FarmConfig read() {
    const toml::table root = parse_toml(file_);
    for (const auto& [key, node] : root) read_table(std::string(key.str()), node);
    return std::move(config_);
  }
  /// First and last line of each [[token]], by name.
  const std::map<std::string, std::pair<int, int>>& token_lines() const { return token_lines_; }

 private:
  void read_table(const std::string& key, const toml::node& node) {
    if (key == "farm")
      config_.server = params_from_section<FarmConfig::Server>(section(key, node));
    else if (key == "snapshots")
      config_.snapshots = params_from_section<FarmConfig::Snapshots>(section(key, node));
    else if (key == "logs")
      config_.logs = params_from_section<FarmConfig::Logs>(section(key, node));
    else if (key == "token")
      for_each(key, node, [this](const Section& s) { read_token(s); });
    else if (key == "notify")
      for_each(key, node, [this](const Section& s) { read_notify(s); });
    else
      throw Error(
          ErrorKind::BadInput,
          fmt::format("{}:{}: unknown table [{}]{}", file_, line_of(node), key,
                      did_you_mean(key, std::vector<std::string>{"farm", "snapshots", "logs", "token", "notify"})));
  }

  Section section(const std::string& key, const toml::node& node) const {
    if (const auto* table = node.as_table()) return flat_section(*table, file_, key);
    throw Error(ErrorKind::BadInput, fmt::format("{}:{}: '{}' must be a table: [{}]", file_, line_of(node), key, key));
  }

  void for_each(const std::string& key, const toml::node& node, const std::function<void(const Section&)>& read) const {
    const auto* array = node.as_array();
    if (array == nullptr)
      throw Error(ErrorKind::BadInput,
                  fmt::format("{}:{}: write [[{}]] with double brackets", file_, line_of(node), key));
    for (const auto& item : *array) read(section(key, item));
  }

  void read_token(const Section& s) {
    const auto token = params_from_section<FarmConfig::Token>(s);
    check_token(token, s);
    int last = s.line;
    for (const auto& [key, value] : s.values) last = std::max(last, value.line);
    if (!token_lines_.emplace(token.name, std::pair(s.line, last)).second)
      fail(s, fmt::format("name '{}' is there twice", token.name));
    config_.tokens.push_back(token);
  }

  void read_notify(const Section& s) {
    auto hook = params_from_section<FarmConfig::Notify>(s);
    if (hook.name.empty()) hook.name = fmt::format("notify{}", config_.notify.size() + 1);
    check_notify(hook, s);
    if (!hook_names_.insert(hook.name).second) fail(s, fmt::format("name '{}' is there twice", hook.name));
    config_.notify.push_back(std::move(hook));
  }

  std::string file_;
  FarmConfig config_;
  std::map<std::string, std::pair<int, int>> token_lines_;
  std::set<std::string> hook_names_;
};

template <class Table>
void write_table(std::string& out, const std::string& name, Table table) {
  out += fmt::format("\n[{}]\n", name);
  table.fields([&](const char* key, auto& member, const auto& limits, const char* meaning) {
    const std::string allowed = params_detail::describe(limits);
    out += fmt::format("# {}{}\n{} = {}\n", meaning, allowed == "any" ? "" : fmt::format(" ({})", allowed), key,
                       Json(member).dump());
  });
}

std::string token_text(const FarmConfig::Token& token) {
  return fmt::format("\n[[token]]\nname = \"{}\"\nrole = \"{}\"\nsha256 = \"{}\"\n", token.name, token.role,
                     token.sha256);
}

/// A changed file replaces the old one only when it can be read again.
void replace_config(const fs::path& state_dir, const std::string& text) {
  const fs::path file = farm_config_file(state_dir), trial = file.string() + ".new";
  write_file_atomically(trial, text, kOwnerOnly);
  try {
    Reader(trial).read();
  } catch (...) {
    fs::remove(trial);
    throw;
  }
  fs::rename(trial, file);
  fsync_path(state_dir);
}

}  // namespace

const std::vector<std::string>& notify_events() {
  static const std::vector<std::string> events{"shot_done",   "shot_failed",      "job_quarantined",
                                               "worker_lost", "worker_set_aside", "disk_low"};
  return events;
}

fs::path farm_config_file(const fs::path& state_dir) { return state_dir / "farm.toml"; }

FarmConfig read_farm_config(const fs::path& state_dir) {
  const fs::path file = farm_config_file(state_dir);
  FarmConfig config;
  if (fs::exists(file)) with_one_line_errors([&] { config = Reader(file).read(); });
  return config;
}

NewToken new_token(const std::string& name, const std::string& role) {
  const std::string text = "vantage_" + to_hex(random_bytes(24));
  return {.text = text, .entry = {.name = name, .role = role, .sha256 = sha256_hex(text)}};
}

void write_farm_config(const fs::path& state_dir, const FarmConfig::Server& server,
                       const std::vector<FarmConfig::Token>& tokens) {
  std::string out = "# How this farm is set up. Read at the start of the scheduler; its options win over this file.\n";
  write_table(out, "farm", server);
  write_table(out, "snapshots", FarmConfig::Snapshots{});
  write_table(out, "logs", FarmConfig::Logs{});
  out += fmt::format(
      "\n# Who is told of what. Events: {}.\n"
      "# [[notify]]\n# name = \"night\"\n# on = [\"shot_done\", \"shot_failed\"]\n"
      "# command = [\"/usr/local/bin/tell\", \"--loud\"]   # gets the event as JSON on its standard input\n"
      "# or: webhook = \"https://chat.example/hook\"\n"
      "\n# Who may ask the API: 'vantage farm token add' and 'remove' write here.\n",
      fmt::join(notify_events(), ", "));
  for (const auto& token : tokens) out += token_text(token);
  replace_config(state_dir, out);
}

void add_token(const fs::path& state_dir, const FarmConfig::Token& token) {
  for (const auto& other : read_farm_config(state_dir).tokens)
    if (other.name == token.name)
      throw Error(ErrorKind::BadInput,
                  fmt::format("{}: has a token '{}' already; 'vantage farm token remove' takes it out",
                              farm_config_file(state_dir).string(), token.name));
  const fs::path file = farm_config_file(state_dir);
  replace_config(state_dir, (fs::exists(file) ? read_file(file) : std::string()) + token_text(token));
}

void remove_token(const fs::path& state_dir, const std::string& name) {
  const fs::path file = farm_config_file(state_dir);
  Reader reader(file);
  if (fs::exists(file)) reader.read();
  const auto found = reader.token_lines().find(name);
  if (found == reader.token_lines().end()) {
    std::vector<std::string> names;
    for (const auto& [known, lines] : reader.token_lines()) names.push_back(known);
    throw Error(ErrorKind::BadInput,
                fmt::format("{}: has no token '{}'{}", file.string(), name, did_you_mean(name, names)));
  }
  std::istringstream in(read_file(file));
  std::string text, line;
  for (int number = 1; std::getline(in, line); ++number)
    if (number < found->second.first || number > found->second.second) text += line + "\n";
  replace_config(state_dir, text);
}

}  // namespace vantage

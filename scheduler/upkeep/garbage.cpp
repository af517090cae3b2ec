#include "scheduler/upkeep/garbage.h"

#include <fmt/format.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>

namespace vantage {
namespace fs = std::filesystem;
namespace {

/// A process that has just ended may have been restarted: its successor cleans up first.
constexpr std::int64_t kUnfinishedHereMs = 600'000;
/// Of another machine nobody knows whether the process lives; no job takes longer than a day without a write.
constexpr std::int64_t kUnfinishedElsewhereMs = 86'400'000;

/// Wall clock; 0 when it is not there any more.
std::int64_t changed_ms(const fs::path& path) {
  struct stat info {};
  if (lstat(path.c_str(), &info) != 0) return 0;
  return static_cast<std::int64_t>(info.st_mtim.tv_sec) * 1000 + info.st_mtim.tv_nsec / 1'000'000;
}

std::int64_t newest_change_ms(const fs::path& folder) {
  std::int64_t newest = changed_ms(folder);
  std::error_code vanished;  // its owner goes on meanwhile
  for (const auto& entry : fs::recursive_directory_iterator(folder, vanished))
    newest = std::max(newest, changed_ms(entry.path()));
  return newest;
}

std::uintmax_t size_of(const fs::path& path) {
  std::error_code vanished;
  if (!fs::is_directory(path, vanished)) return fs::file_size(path, vanished);
  std::uintmax_t num_bytes = 0;
  for (const auto& entry : fs::recursive_directory_iterator(path, vanished))
    if (entry.is_regular_file(vanished)) num_bytes += entry.file_size(vanished);
  return num_bytes;
}

std::string age_text(std::int64_t age_ms) {
  const std::int64_t hours = age_ms / 3'600'000;
  return hours < 48 ? fmt::format("{} h old", hours) : fmt::format("{} days old", hours / 24);
}

bool is_hidden(const fs::path& path) { return path.filename().string().starts_with("."); }

void find_artifacts(const fs::path& store, const Reach& reach, const GarbageAges& ages, std::vector<Garbage>& out) {
  for (const auto& kind : fs::directory_iterator(store)) {
    if (!kind.is_directory() || is_hidden(kind.path())) continue;
    for (const auto& artifact : fs::directory_iterator(kind.path())) {
      const std::string name = kind.path().filename().string() + "/" + artifact.path().filename().string();
      const std::int64_t age_ms = ages.now_ms - changed_ms(artifact.path());
      if (reach.artifacts.contains(name) || age_ms < ages.keep_ms) continue;
      out.push_back({Garbage::What::Artifact, artifact.path(), size_of(artifact.path()),
                     fmt::format("no shot's present plan has it; {}", age_text(age_ms))});
    }
  }
}

/// Of "<key>.<host>.<pid>.<random>"; pid 0 when it is no such name. A host's name may have dots.
struct Owner {
  std::string host;
  int pid = 0;
};
Owner owner_of(const std::string& name) {
  const auto host = name.find('.'), random = name.rfind('.');
  const auto pid = random == std::string::npos || random == 0 ? std::string::npos : name.rfind('.', random - 1);
  if (pid == std::string::npos || pid <= host) return {};
  Owner owner{.host = name.substr(host + 1, pid - host - 1), .pid = 0};
  std::from_chars(name.data() + pid + 1, name.data() + random, owner.pid);
  return owner;
}

void find_unfinished(const fs::path& store, const GarbageAges& ages, std::vector<Garbage>& out) {
  std::array<char, 256> this_host{};
  gethostname(this_host.data(), this_host.size() - 1);
  std::error_code none;  // no attempt has run yet
  for (const auto& entry : fs::directory_iterator(store / ".tmp", none)) {
    const Owner owner = owner_of(entry.path().filename().string());
    const bool here = owner.host == this_host.data();
    if (here && owner.pid > 0 && (kill(owner.pid, 0) == 0 || errno != ESRCH)) continue;
    const std::int64_t age_ms = ages.now_ms - newest_change_ms(entry.path());
    if (age_ms < (here ? kUnfinishedHereMs : kUnfinishedElsewhereMs)) continue;
    out.push_back({Garbage::What::Unfinished, entry.path(), size_of(entry.path()),
                   here ? fmt::format("process {} has ended; {}", owner.pid, age_text(age_ms))
                        : fmt::format("left by host {}; {}", owner.host, age_text(age_ms))});
  }
}

/// Results that a person did not trust, kept to be compared with what their jobs made again.
void find_aside(const fs::path& shot, const GarbageAges& ages, std::vector<Garbage>& out) {
  std::error_code none;
  for (const auto& entry : fs::directory_iterator(shot / ".vantage" / "aside", none)) {
    const std::int64_t age_ms = ages.now_ms - newest_change_ms(entry.path());
    if (age_ms < std::max(ages.keep_ms, kUnfinishedElsewhereMs)) continue;
    out.push_back({Garbage::What::Unfinished, entry.path(), size_of(entry.path()),
                   fmt::format("was moved aside to be made again; {}", age_text(age_ms))});
  }
}

void find_specs(const fs::path& shot, const Reach& reach, const GarbageAges& ages, std::vector<Garbage>& out) {
  std::error_code none;
  for (const auto& entry : fs::recursive_directory_iterator(shot / ".vantage" / "specs", none)) {
    const std::int64_t age_ms = ages.now_ms - changed_ms(entry.path());
    if (!entry.is_regular_file() || reach.spec_names.contains(entry.path().string()) || age_ms < ages.keep_ms) continue;
    out.push_back({Garbage::What::Spec, entry.path(), size_of(entry.path()), "its job is in no present plan"});
  }
}

}  // namespace

std::string_view to_string(Garbage::What what) {
  switch (what) {
    case Garbage::What::Artifact:
      return "artifact";
    case Garbage::What::Unfinished:
      return "unfinished";
    case Garbage::What::Spec:
      return "spec";
    case Garbage::What::Log:
      return "log";
  }
  return "";
}

std::vector<Garbage> find_old_logs(const fs::path& shot, const Reach& reach, const GarbageAges& ages) {
  struct Log {
    std::int64_t at_ms;
    fs::path path;
    std::uintmax_t num_bytes;
  };
  std::vector<Log> logs;
  std::error_code none;
  for (const auto& entry : fs::recursive_directory_iterator(shot / ".vantage" / "logs", none))
    if (entry.is_regular_file(none) && !reach.open_logs.contains(entry.path().string()))
      logs.push_back({changed_ms(entry.path()), entry.path(), size_of(entry.path())});
  std::sort(logs.begin(), logs.end(), [](const Log& a, const Log& b) { return a.at_ms > b.at_ms; });
  std::vector<Garbage> old;
  std::uintmax_t num_kept_bytes = 0;
  for (const Log& log : logs) {
    const std::int64_t age_ms = ages.now_ms - log.at_ms;
    num_kept_bytes += log.num_bytes;
    if (age_ms >= ages.keep_logs_ms)
      old.push_back({Garbage::What::Log, log.path, log.num_bytes, age_text(age_ms)});
    else if (num_kept_bytes > ages.max_log_bytes)
      old.push_back({Garbage::What::Log, log.path, log.num_bytes,
                     fmt::format("newer logs fill the {} MB that are kept", ages.max_log_bytes / 1'000'000)});
  }
  return old;
}

std::vector<Garbage> find_garbage(const fs::path& store, const Reach& reach, const GarbageAges& ages) {
  std::vector<Garbage> garbage;
  find_artifacts(store, reach, ages, garbage);
  find_unfinished(store, ages, garbage);
  for (const fs::path& shot : reach.shots) {
    find_specs(shot, reach, ages, garbage);
    find_aside(shot, ages, garbage);
    const auto logs = find_old_logs(shot, reach, ages);
    garbage.insert(garbage.end(), logs.begin(), logs.end());
  }
  std::sort(garbage.begin(), garbage.end(), [](const Garbage& a, const Garbage& b) { return a.path < b.path; });
  return garbage;
}

}  // namespace vantage

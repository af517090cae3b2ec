#include "scheduler/cli/progress_display.h"

#include <fmt/format.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <map>

#include "scheduler/report/html.h"
#include "scheduler/store/job_state.h"

namespace vantage {
namespace {

constexpr std::int64_t kPlainEveryMs = 5000;
constexpr int kBarWidth = 30;
constexpr std::size_t kSentencesShown = 3;

int count_where(const ShotProgress::Kind& kind, bool (*wanted)(JobState)) {
  int sum = 0;
  for (const auto& [word, n] : kind.num_by_state)
    if (const auto state = job_state_from(word); state && wanted(*state)) sum += n;
  return sum;
}

std::string eta_text(const ShotProgress& progress) {
  const auto left_s = remaining_s(progress, progress.num_workers);
  return left_s ? fmt::format(", about {} left of what is planned", html::duration(*left_s)) : "";
}

std::string total_line(const ShotProgress& progress) {
  return fmt::format("{} of {} jobs, {} running{}", progress.num_finished(), progress.num_jobs(),
                     progress.running.size(), eta_text(progress));
}

class TerminalDisplay : public ProgressDisplay {
 public:
  void show(const ShotProgress& progress, std::int64_t) override {
    const std::size_t columns = num_columns();
    std::vector<std::string> lines;
    for (const auto& kind : progress.kinds) lines.push_back(stage_line(progress, kind));
    for (const auto& sentence : sentences_) lines.push_back("  ! " + sentence);
    lines.push_back("  " + total_line(progress));
    std::string text = num_drawn_ > 0 ? fmt::format("\x1b[{}A", num_drawn_) : "";
    for (const auto& line : lines) text += "\x1b[2K" + cut(line, columns) + "\x1b[0m\n";
    text += "\x1b[J";
    num_drawn_ = lines.size();
    fmt::print("{}", text);
    std::fflush(stdout);
  }
  void say(const std::string& sentence) override {
    sentences_.push_back(sentence);
    if (sentences_.size() > kSentencesShown) sentences_.erase(sentences_.begin());
  }

 private:
  static std::size_t num_columns() {
    winsize size{};
    return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
  }
  /// A line that wraps would spoil the count of lines to go back. Stage lines hold ASCII only but for the phase.
  static std::string cut(const std::string& line, std::size_t columns) {
    std::string out;
    std::size_t width = 0;
    for (std::size_t i = 0; i < line.size(); ++i) {
      const bool starts_character = (static_cast<unsigned char>(line[i]) & 0xC0) != 0x80;
      if (starts_character && ++width >= columns) break;
      out += line[i];
    }
    return out;
  }
  static std::string stage_line(const ShotProgress& progress, const ShotProgress::Kind& kind) {
    std::string line = fmt::format("  {:<12} [{}] {:>5}/{:<5}", kind.kind, bar_text(kind, kBarWidth), kind.num_finished,
                                   kind.num_jobs);
    if (const int bad = count_where(kind, is_bad); bad > 0) line += fmt::format(" {} failed", bad);
    for (const auto& job : progress.running)
      if (job.name.substr(0, job.name.find('/')) == kind.kind)
        return line + fmt::format(" {:3.0f} % {}", 100 * job.progress, job.phase);
    return line;
  }

  std::size_t num_drawn_ = 0;
  std::vector<std::string> sentences_;
};

class PlainDisplay : public ProgressDisplay {
 public:
  void show(const ShotProgress& progress, std::int64_t now_ms) override {
    for (const auto& kind : progress.kinds) show_if_ended(kind);
    if (now_ms - last_ms_ < kPlainEveryMs) return;
    last_ms_ = now_ms;
    line(total_line(progress) + busy_with(progress));
  }
  void say(const std::string& sentence) override { line(sentence); }

 private:
  static void line(const std::string& text) {
    fmt::print("{}\n", text);
    std::fflush(stdout);
  }
  void show_if_ended(const ShotProgress::Kind& kind) {
    const bool ended = kind.num_jobs > 0 && kind.num_finished == kind.num_jobs;
    int& last = ended_with_[kind.kind];
    if (!ended || last == kind.num_jobs) return;
    last = kind.num_jobs;
    const int bad = count_where(kind, is_bad);
    line(fmt::format("{}: {} of {} jobs good, {} of work", kind.kind, kind.num_jobs - bad, kind.num_jobs,
                     html::duration(static_cast<double>(kind.wall_ms) / 1000)));
  }
  static std::string busy_with(const ShotProgress& progress) {
    std::map<std::string, int> by_kind;
    for (const auto& job : progress.running) ++by_kind[job.name.substr(0, job.name.find('/'))];
    std::string text;
    for (const auto& [kind, n] : by_kind) text += fmt::format("{} {}", text.empty() ? ":" : ",", kind);
    return text;
  }

  std::int64_t last_ms_ = 0;
  std::map<std::string, int> ended_with_;
};

class SilentDisplay : public ProgressDisplay {
 public:
  void show(const ShotProgress&, std::int64_t) override {}
  void say(const std::string&) override {}
};

}  // namespace

std::unique_ptr<ProgressDisplay> make_terminal_display() { return std::make_unique<TerminalDisplay>(); }
std::unique_ptr<ProgressDisplay> make_plain_display() { return std::make_unique<PlainDisplay>(); }
std::unique_ptr<ProgressDisplay> make_silent_display() { return std::make_unique<SilentDisplay>(); }

std::optional<double> remaining_s(const ShotProgress& progress, int num_workers) {
  double left_s = 0;
  for (const auto& kind : progress.kinds) {
    const int left = kind.num_jobs - kind.num_finished;
    if (left == 0) continue;
    if (kind.num_finished == 0 || kind.wall_ms == 0) return std::nullopt;
    left_s += left * static_cast<double>(kind.wall_ms) / 1000 / kind.num_finished;
  }
  return left_s / std::max(1, num_workers);
}

std::string bar_text(const ShotProgress::Kind& kind, int width) {
  if (kind.num_jobs == 0) return std::string(static_cast<std::size_t>(width), ' ');
  const int finished = width * kind.num_finished / kind.num_jobs;
  const int active = count_where(kind, is_active);
  const int running = std::min(width - finished, active > 0 ? std::max(1, width * active / kind.num_jobs) : 0);
  const auto times = [](int n, char c) { return std::string(static_cast<std::size_t>(n), c); };
  return times(finished, '#') + times(running, '>') + times(width - finished - running, '-');
}

}  // namespace vantage

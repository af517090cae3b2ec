#include "scheduler/cli/stop_signal.h"

#include <signal.h>
#include <time.h>
#include <unistd.h>

namespace vantage {
namespace {

// Signal handlers can reach nothing but globals.
volatile sig_atomic_t was_asked = 0;
timespec asked_at{};

/// Who signals a process group and its leader, as timeout(1) does, sends two at once and means one.
constexpr double kImpatientS = 0.5;

void on_signal(int number) {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  const double since_s =
      static_cast<double>(now.tv_sec - asked_at.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec - asked_at.tv_nsec);
  if (was_asked != 0 && since_s > kImpatientS) _exit(128 + number);
  if (was_asked == 0) asked_at = now;
  was_asked = 1;
}

}  // namespace

void note_stop_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigaddset(&action.sa_mask, SIGINT);  // one at a time: the handler's globals are not atomic together
  sigaddset(&action.sa_mask, SIGTERM);
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);  // a reader of our output or of the page may go away at any time
}

bool stop_was_asked() { return was_asked != 0; }

}  // namespace vantage

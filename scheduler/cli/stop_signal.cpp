#include "scheduler/cli/stop_signal.h"

#include <signal.h>
#include <unistd.h>

namespace vantage {
namespace {

volatile sig_atomic_t num_asked = 0;  // signal handlers can reach nothing but a global

void on_signal(int number) {
  if (num_asked > 0) _exit(128 + number);
  num_asked = 1;
}

}  // namespace

void note_stop_signals() {
  struct sigaction action {};
  action.sa_handler = on_signal;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  signal(SIGPIPE, SIG_IGN);  // a reader of our output or of the page may go away at any time
}

bool stop_was_asked() { return num_asked > 0; }

}  // namespace vantage

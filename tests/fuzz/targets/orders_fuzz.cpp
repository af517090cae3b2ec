// What anybody may send to the API: heads of requests, and bodies of orders.
#include "scheduler/api/connection.h"
#include "scheduler/api/order_bodies.h"
#include "tests/fuzz/targets/fuzzing.h"

namespace vantage {
namespace {

void read_head(const std::string& text) {
  RequestHead head;
  if (check_lines(text, {}) || !text.ends_with("\r\n\r\n")) return;
  const auto answer = check_head(text, {}, head);
  if (answer) early_answer_text(*answer);
  check(answer || head.body_bytes <= HttpLimits{}.max_body_bytes, "a body that is taken is within its limit");
}

}  // namespace
}  // namespace vantage

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vantage;
  std::string_view bytes(reinterpret_cast<const char*>(data), size);
  const unsigned choice = take_choice(bytes, 4);
  const std::string text(bytes);
  expect_read_or_refused([&] {
    if (choice == 0) read_submission(text);
    if (choice == 1) read_order({.verb = Command::Verb::Priority}, text);
    if (choice == 2) read_order({.verb = Command::Verb::Retry}, text);
    if (choice == 3) read_head(text);
  });
  return 0;
}

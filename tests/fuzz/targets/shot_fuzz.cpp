#include "schema/shot/shot.h"
#include "tests/fuzz/targets/fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vantage;
  write_bytes(scratch_folder() / "shot.toml", {reinterpret_cast<const char*>(data), size});
  expect_read_or_refused([] { read_shot(scratch_folder(), {"ingest", "calibrate", "sync", "depth", "render"}); });
  return 0;
}

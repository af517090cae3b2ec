#include "scheduler/farm/farm_config.h"
#include "tests/fuzz/targets/fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vantage;
  write_bytes(farm_config_file(scratch_folder()), {reinterpret_cast<const char*>(data), size});
  expect_read_or_refused([] { read_farm_config(scratch_folder()); });
  return 0;
}

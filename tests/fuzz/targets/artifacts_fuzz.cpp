// What workers leave in the store, and what schedulers leave for workers.
#include "schema/formats/job_file.h"
#include "schema/formats/manifest.h"
#include "tests/fuzz/targets/fuzzing.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vantage;
  std::string_view bytes(reinterpret_cast<const char*>(data), size);
  if (take_choice(bytes, 2) == 0) {
    write_bytes(scratch_folder() / "manifest.json", bytes);
    expect_read_or_refused([] { read_valid_manifest(scratch_folder(), /*check_hashes=*/true); });
  } else {
    write_bytes(scratch_folder() / "spec.json", bytes);
    expect_read_or_refused([] { job_key(read_job_file(scratch_folder() / "spec.json")); });
  }
  return 0;
}

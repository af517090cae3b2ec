#include "schema/base/hash.h"

#include <gtest/gtest.h>

#include "schema/base/did_you_mean.h"
#include "schema/base/error.h"
#include "schema/base/files.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {

TEST(Hash, FileAndMemoryAgree) {
  const TemporaryFolder folder;
  const std::string bytes(3'000'000, 'x');
  write_file_atomically(folder.path() / "f", bytes);
  EXPECT_EQ(hash_file(folder.path() / "f"), hash_bytes(bytes));
  EXPECT_NE(hash_bytes("a"), hash_bytes("b"));
}

TEST(Hash, KnownAnswers) {
  EXPECT_EQ(sha256_key("abc"), "ba7816bf8f01cfea414140de5dae2223");  // FIPS 180-2
  EXPECT_EQ(to_hex(hmac_sha256_128("key", "The quick brown fox jumps over the lazy dog")),
            "f7bc83f430538424b13298e6aa6fb143");
}

TEST(Error, KindsSurviveTheirWords) {
  for (const ErrorKind kind :
       {ErrorKind::BadInput, ErrorKind::Transient, ErrorKind::Resource, ErrorKind::Crash, ErrorKind::Bug})
    EXPECT_EQ(error_kind_from(to_string(kind)), kind);
}

TEST(DidYouMean, SuggestsTheNearWordOnly) {
  const std::vector<std::string> words{"render", "reconstruct", "depth"};
  EXPECT_EQ(did_you_mean("rendr", words), " (did you mean 'render'?)");
  EXPECT_EQ(did_you_mean("banana", words), "");
}

}  // namespace
}  // namespace vantage

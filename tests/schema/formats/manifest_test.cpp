#include "schema/formats/manifest.h"

#include <gtest/gtest.h>

#include "schema/base/files.h"
#include "schema/formats/job_file.h"
#include "tests/support/temporary_folder.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

/// A complete artifact of two files.
Manifest make_artifact(const fs::path& folder) {
  fs::create_directories(folder / "sub");
  write_file_atomically(folder / "a.txt", "alpha");
  write_file_atomically(folder / "sub/b.txt", "beta");
  Manifest m{
      .kind = "depth", .version = 1, .job = "depth/x", .key = "k", .content = "", .files = list_artifact_files(folder)};
  m.content = content_hash(m.files);
  write_manifest(folder, m);
  return m;
}

TEST(Manifest, CompleteArtifactIsBelieved) {
  const TemporaryFolder folder;
  const Manifest m = make_artifact(folder.path());
  const auto back = read_valid_manifest(folder.path(), true);
  ASSERT_TRUE(back.has_value());
  EXPECT_EQ(back->content, m.content);
  EXPECT_EQ(back->files.size(), 2U);
}

TEST(Manifest, MissingShortenedOrChangedFilesAreNotBelieved) {
  const TemporaryFolder folder;
  make_artifact(folder.path() / "missing");
  fs::remove(folder.path() / "missing/a.txt");
  EXPECT_FALSE(read_valid_manifest(folder.path() / "missing").has_value());

  make_artifact(folder.path() / "short");
  fs::resize_file(folder.path() / "short/a.txt", 2);
  EXPECT_FALSE(read_valid_manifest(folder.path() / "short").has_value());

  make_artifact(folder.path() / "flipped");
  write_file_atomically(folder.path() / "flipped/a.txt", "alphb");
  const auto written = fs::last_write_time(folder.path() / "flipped/manifest.json");
  fs::last_write_time(folder.path() / "flipped/a.txt", written + std::chrono::seconds(1));
  EXPECT_FALSE(read_valid_manifest(folder.path() / "flipped").has_value()) << "it is younger than its manifest";
  fs::last_write_time(folder.path() / "flipped/a.txt", written);
  EXPECT_TRUE(read_valid_manifest(folder.path() / "flipped").has_value()) << "sizes and times alone cannot tell";
  EXPECT_FALSE(read_valid_manifest(folder.path() / "flipped", true).has_value());
}

TEST(Manifest, HalfWrittenManifestIsNotBelieved) {
  const TemporaryFolder folder;
  make_artifact(folder.path());
  fs::resize_file(folder.path() / "manifest.json", fs::file_size(folder.path() / "manifest.json") / 2);
  EXPECT_FALSE(read_valid_manifest(folder.path()).has_value());
}

JobFile example_job() {
  JobFile j;
  j.kind = "depth";
  j.version = 1;
  j.job = "depth/cam0-000001";
  j.params = {{"max_error_px", 1.5}};
  j.unit = {{"frame", 1}};
  j.inputs["calibrate"] = {"/store/calibrate/x", "c0ffee"};
  return j;
}

TEST(JobFile, KeyDependsOnContentsButNotOnPlacesOrNames) {
  const std::string key = job_key(example_job());
  JobFile moved = example_job();
  moved.inputs["calibrate"].folder = "/elsewhere";
  moved.shot = "another";
  moved.ram_mb = 9;
  EXPECT_EQ(job_key(moved), key);
  JobFile changed = example_job();
  changed.inputs["calibrate"].content = "decaf";
  EXPECT_NE(job_key(changed), key);
  JobFile newer = example_job();
  newer.version = 2;
  EXPECT_NE(job_key(newer), key);
}

TEST(JobFile, RoundTrip) {
  const TemporaryFolder folder;
  JobFile j = example_job();
  j.key = job_key(j);
  write_json(folder.path() / "spec.json", to_json(j));
  EXPECT_EQ(to_json(read_job_file(folder.path() / "spec.json")), to_json(j));
}

}  // namespace
}  // namespace vantage

// make_corpus FOLDER: valid inputs of every target, made by the code that writes them in earnest.
#include <sstream>

#include "scheduler/farm/farm_config.h"
#include "schema/base/hash.h"
#include "schema/formats/job_file.h"
#include "schema/formats/manifest.h"
#include "schema/messages/codec.h"
#include "tests/fuzz/targets/fuzzing.h"

namespace vantage {
namespace {
namespace fs = std::filesystem;

class Corpus {
 public:
  Corpus(const fs::path& folder, const std::string& target) : folder_(folder / target) {
    fs::create_directories(folder_);
  }
  void add(const std::string& name, const std::string& bytes) const { write_bytes(folder_ / name, bytes); }

 private:
  fs::path folder_;
};

std::string read_bytes(const fs::path& file) {
  std::ostringstream text;
  text << std::ifstream(file, std::ios::binary).rdbuf();
  return std::move(text).str();
}

/// Without its signature: the target signs it again.
std::string datagram_of(const Message& message) {
  const std::string whole =
      encode(message, {.sender = "w1", .incarnation = 7, .seq = 9}, farm_of_key("some key of sixteen letters")).front();
  return whole.substr(0, whole.size() - 16);
}

void add_messages(const Corpus& corpus) {
  const AttemptRef ref{.job_id = 17, .number = 2, .token = 0x123456789abcdef};
  WorkerReport report{.worker_id = "w1", .incarnation = 7, .seq = 9, .host = "studio", .pool = "night"};
  report.slots = report.cores = 4;
  corpus.add("report-idle", '\1' + datagram_of(report));
  report.running = {{.ref = ref, .phase = "matching", .progress = 0.5, .rss_mb = 900}};
  report.done_unacked = {{.ref = ref, .outcome = Outcome::Crashed, .error_kind = "crash", .message = "signal 11"}};
  corpus.add("report-busy", '\1' + datagram_of(report));
  WorkerOrders orders{.worker_id = "w1", .incarnation = 7, .epoch = 3, .seq = 9, .lease_ms = 15000};
  corpus.add("orders-empty", '\1' + datagram_of(orders));
  orders.assigned = {{.ref = ref, .spec_path = "/shot/.vantage/specs/a.json", .spec_hash = "00", .log_path = "/l"}};
  orders.canceled = orders.acked = {ref};
  corpus.add("orders-full", '\1' + datagram_of(orders));
  corpus.add("hello", '\1' + datagram_of(SchedulerHello{.farm_id = "f", .epoch = 3, .http_address = "http://a:1"}));
  corpus.add("unsigned", std::string(1, '\0') + datagram_of(report));
}

void add_orders(const Corpus& corpus) {
  corpus.add("submission", std::string(1, '\0') + R"({"folder": "/shots/a", "until": "depth", "priority": -3})");
  corpus.add("priority", '\1' + std::string(R"({"priority": 5, "stage": "depth"})"));
  corpus.add("preview", '\2' + std::string(R"({"dry_run": true})"));
  corpus.add("get", "\3GET /api/v1/shots HTTP/1.1\r\nHost: localhost\r\n\r\n");
  corpus.add("post",
             "\3POST /api/v1/shots HTTP/1.1\r\nHost: a\r\nContent-Length: 12\r\nAuthorization: Bearer x\r\n\r\n");
}

void add_shots(const Corpus& corpus) {
  const std::string cameras =
      "[shot]\nname = \"a\"\n[[camera]]\nname = \"l\"\nfootage = \"l.mp4\"\n[[camera]]\nname = \"r\"\nfootage = "
      "\"r.mp4\"\n";
  corpus.add("least", cameras);
  corpus.add(
      "stages",
      cameras +
          "[calibrate]\nmethod = \"known\"\nmodel = \"m\"\n[sync]\nmethod = \"audio\"\n[depth]\nmax_error_px = 1.5\n");
  corpus.add(
      "render",
      cameras +
          "[[render]]\nname = \"f\"\nmode = \"stereo\"\nfps = 30\nkeyframes = [{at_s = 0, time_s = 0.1, azimuth_deg = "
          "-5, elevation_deg = 1}, {at_s = 1, time_s = 0.1}]\n");
}

void add_farm_configs(const Corpus& corpus) {
  corpus.add("server",
             "[farm]\nlisten = \"0.0.0.0:8080\"\nbus_port = 7700\nlease_s = 15\n[snapshots]\nevery_min = 60\n");
  corpus.add("token", "[[token]]\nname = \"ada\"\nrole = \"operate\"\nsha256 = \"" + sha256_hex("x") + "\"\n");
  corpus.add("notify", "[[notify]]\nname = \"mail\"\non = [\"shot_done\"]\ncommand = [\"mail\", \"me\"]\n");
}

void add_artifacts(const Corpus& corpus) {
  const std::vector<Manifest::File> files{{"depth.exr", 0, hash_bytes("")}};
  write_manifest(scratch_folder(), {.kind = "depth",
                                    .version = 1,
                                    .job = "depth/a",
                                    .key = "k",
                                    .content = content_hash(files),
                                    .files = files,
                                    .figures = {{"inliers", 3}}});
  corpus.add("manifest", std::string(1, '\0') + read_bytes(scratch_folder() / "manifest.json"));
  JobFile job{.kind = "depth", .version = 1, .job = "depth/a", .shot = "/s", .key = "k", .params = {{"sigma", 1.5}}};
  job.inputs["align"] = {.folder = "/s/.vantage/store/align/e1", .content = "c"};
  corpus.add("job", '\1' + to_json(job).dump());
}

}  // namespace
}  // namespace vantage

int main(int argc, char** argv) {
  using namespace vantage;
  if (argc != 2) return std::cerr << "make_corpus FOLDER\n", 2;
  add_messages({argv[1], "messages"});
  add_orders({argv[1], "orders"});
  add_shots({argv[1], "shot"});
  add_farm_configs({argv[1], "farm_config"});
  add_artifacts({argv[1], "artifacts"});
}

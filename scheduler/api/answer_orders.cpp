// Answers to people who want something changed.
#include <fmt/format.h>

#include "scheduler/api/handlers.h"
#include "scheduler/api/order_bodies.h"
#include "schema/base/did_you_mean.h"
#include "schema/base/hash.h"

namespace vantage {
namespace {

using enum Command::Verb;
const std::map<std::string, Command::Verb> kShotVerbs{{"pause", Pause}, {"resume", Resume}, {"cancel", Cancel},
                                                      {"retry", Retry}, {"rerun", Rerun},   {"priority", Priority}};
const std::map<std::string, Command::Verb> kWorkerVerbs{
    {"drain", Drain}, {"undrain", Undrain}, {"hours", Hours}, {"forgive", Forgive}, {"selftest", SelfTest}};
constexpr std::size_t kMaxKeyBytes = 200;

Command::Verb verb_from(const std::map<std::string, Command::Verb>& verbs, const std::string& word) {
  const auto found = verbs.find(word);
  if (found != verbs.end()) return found->second;
  std::vector<std::string> words;
  for (const auto& [known, verb] : verbs) words.push_back(known);
  throw NotFound(fmt::format("there is no action '{}'{}: {}", word, did_you_mean(word, words), fmt::join(words, ", ")));
}

OnceKey once_key(const Call& call) {
  const auto& request = *call.request;
  OnceKey once{.key = request.get_header_value("Idempotency-Key"), .who = call.pass.who};
  if (once.key.size() > kMaxKeyBytes)
    throw Error(ErrorKind::BadInput,
                fmt::format("Idempotency-Key has {} characters, at most {} are taken", once.key.size(), kMaxKeyBytes));
  once.fingerprint = sha256_hex(request.method + " " + request.path + "\n" + request.body);
  return once;
}

}  // namespace

void Handlers::submit(const Call& call, httplib::Response& res) {
  SubmitRequest request = read_submission(call.request->body);
  request.who = call.pass.who;
  answer_json(res, context_.control.submit(std::move(request), once_key(call)));
}

void Handlers::order(const Call& call, Command command, httplib::Response& res) {
  command = read_order(std::move(command), call.request->body);
  command.who = call.pass.who;
  answer_json(res, context_.control.command(command, command.dry_run ? OnceKey{} : once_key(call)));
}

void Handlers::order_shot(const Call& call, httplib::Response& res) {
  order(call, {.verb = verb_from(kShotVerbs, call.word("verb")), .shot = ShotId{call.number("shot")}}, res);
}
void Handlers::order_job(const Call& call, httplib::Response& res) {
  order(call, {.verb = verb_from(kShotVerbs, call.word("verb")), .job = JobId{call.number("job")}}, res);
}
void Handlers::order_worker(const Call& call, httplib::Response& res) {
  order(call, {.verb = verb_from(kWorkerVerbs, call.word("verb")), .worker = call.word("worker")}, res);
}

}  // namespace vantage

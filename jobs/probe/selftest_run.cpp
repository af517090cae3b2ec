#include <fmt/format.h>

#include <algorithm>

#include "jobs/probe/selftest_checks.h"
#include "jobs/probe/selftest_job.h"
#include "schema/base/error.h"

namespace vantage {
namespace {

bool concerns(const MachineCheck& check, const std::vector<std::string>& kinds) {
  const auto offers = [&](const std::string& kind) {
    return std::any_of(kinds.begin(), kinds.end(), [&](const auto& k) { return k.substr(0, k.find('/')) == kind; });
  };
  return check.for_kinds.empty() || std::any_of(check.for_kinds.begin(), check.for_kinds.end(), offers);
}

}  // namespace

void SelfTestJob::run(JobContext& context, const Params&) {
  std::vector<std::string> failed;
  const auto attempt = [&](const std::string& name, const auto& check) {
    context.progress(0.5, name);
    try {
      check();
      fmt::print("{}: ok\n", name);
    } catch (const std::exception& e) {  // the others are looked at all the same: one visit mends them all
      failed.push_back(fmt::format("{}: {}", name, e.what()));
      fmt::print("{}\n", failed.back());
    }
  };
  attempt("disk", [&] { check_disk(context.unit().at("store").get<std::string>()); });
  const auto kinds = context.unit().at("kinds").get<std::vector<std::string>>();
  for (const MachineCheck& check : machine_checks())
    if (concerns(check, kinds)) attempt(check.name, [&] { check.run(context.scratch()); });
  if (!failed.empty()) throw Error(ErrorKind::Transient, fmt::format("self-test failed: {}", fmt::join(failed, "; ")));
}

}  // namespace vantage

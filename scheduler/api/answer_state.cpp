// Answers about the server itself: its description, its health, who asks.
#include <fmt/format.h>

#include "scheduler/api/handlers.h"
#include "scheduler/api/openapi.h"

namespace vantage {

void answer_json(httplib::Response& res, const Json& value, int status) {
  res.status = status;
  res.set_content(value.dump(-1, ' ', false, Json::error_handler_t::replace), "application/json");
}

void Handlers::openapi(const Call&, httplib::Response& res) {
  res.set_content(openapi_text().data(), openapi_text().size(), "application/json");
}

void Handlers::health(const Call&, httplib::Response& res) {
  const FarmState state = context_.control.state();
  std::string trouble = state.health.trouble;
  try {
    FarmQueries(context_.state_dir).newest_event();
  } catch (const Error& e) {
    if (trouble.empty()) trouble = e.what();
  }
  answer_json(res, {{"ok", trouble.empty()},
                    {"trouble", trouble},
                    {"since_ms", state.health.since_wall_ms},
                    {"epoch", state.stats.epoch},
                    {"version", VANTAGE_VERSION}});
}

void Handlers::session(const Call& call, httplib::Response& res) {
  answer_json(res, {{"who", call.pass.who}, {"role", call.pass.may == Access::Operate ? "operate" : "read"}});
}

/// The cookie stands for reading only, and goes with no request that another site's page makes.
void Handlers::open_session(const Call& call, httplib::Response& res) {
  res.set_header("Set-Cookie", fmt::format("{}={}; Path=/; HttpOnly; SameSite=Strict", context_.cookie,
                                           context_.gate->open_session(call.pass)));
  session(call, res);
}

}  // namespace vantage

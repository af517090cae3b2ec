// Server-sent events: what happened in the farm, as it happens.
#include <fmt/format.h>

#include <charconv>
#include <thread>

#include "scheduler/api/handlers.h"

namespace vantage {
namespace {

constexpr auto kBeat = std::chrono::milliseconds(250);
constexpr int kBeatsPerComment = 40;  ///< a comment every 10 s keeps proxies from closing a quiet stream
constexpr std::int64_t kMaxEvents = 200;

/// One client's place in the farm's events.
class Feed {
 public:
  /// after: the last event that the client has; empty: it has just loaded all there is.
  Feed(const std::filesystem::path& state_dir, std::optional<std::int64_t> after)
      : queries_(state_dir), last_(after.value_or(queries_.newest_event())) {}

  /// The next message; empty while nothing has changed.
  std::optional<std::string> next() {
    const std::int64_t version = queries_.data_version();
    if (version == seen_) return std::nullopt;
    seen_ = version;
    const std::int64_t newest = queries_.newest_event();
    const bool behind = newest - last_ > kMaxEvents || newest < last_;  // less: the database was restored
    const Json events = behind ? Json::array() : queries_.events_after(last_, kMaxEvents);
    last_ = events.empty() ? newest : events.back().at("id").get<std::int64_t>();
    const Json data{{"behind", behind}, {"events", events}};
    return fmt::format("id: {}\nevent: changed\ndata: {}\n\n", last_,
                       data.dump(-1, ' ', false, Json::error_handler_t::replace));
  }

 private:
  FarmQueries queries_;
  std::int64_t last_;
  std::int64_t seen_ = -1;
};

std::optional<std::int64_t> last_event_of(const httplib::Request& request) {
  const std::string text = request.get_header_value("Last-Event-ID");
  std::int64_t id = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), id);
  return error == std::errc{} && end == text.data() + text.size() && id >= 0 ? std::optional(id) : std::nullopt;
}

/// Waits for a change, or a while, then writes one message or comment. False ends the stream.
bool send_next(Feed& feed, const LimitedServer& server, httplib::DataSink& sink) {
  for (int beat = 0; beat < kBeatsPerComment; ++beat) {
    if (server.stopping() || !sink.is_writable()) return false;
    const auto message = feed.next();
    if (message && !sink.write(message->data(), message->size())) return false;
    std::this_thread::sleep_for(kBeat);
    if (message) return true;
  }
  return sink.write(": still here\n\n", 14);
}

}  // namespace

void Handlers::events(const Call& call, httplib::Response& res) {
  if (num_streams_.fetch_add(1) >= context_.limits.max_streams) {
    --num_streams_;
    return answer_json(res, {{"error", "too many event streams are open"}}, 503);
  }
  const auto leave = std::shared_ptr<void>(nullptr, [this](void*) { --num_streams_; });  // also when Feed throws
  auto feed = std::make_shared<Feed>(context_.state_dir, last_event_of(*call.request));
  res.set_header("Cache-Control", "no-store");
  res.set_chunked_content_provider("text/event-stream", [this, feed, leave](std::size_t, httplib::DataSink& sink) {
    return send_next(*feed, *context_.server, sink);
  });
}

}  // namespace vantage

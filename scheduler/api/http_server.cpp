#include "scheduler/api/http_server.h"

#include <fmt/format.h>
#include <httplib.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "scheduler/api/files.h"
#include "scheduler/api/routes.h"
#include "web/web_files.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kNumThreads = 64;
/// Every open event stream holds a thread; some must stay free for ordinary requests.
constexpr int kMaxStreams = 40;
constexpr auto kStreamBeat = std::chrono::milliseconds(250);
constexpr int kBeatsPerComment = 40;  ///< a comment every 10 s finds out that the other side is gone
constexpr std::uintmax_t kMaxLogBytes = 4'000'000;

struct Address {
  std::string host;
  int port = 0;
};

Address parse_address(const std::string& listen) {
  const auto colon = listen.rfind(':');
  const std::string port = colon == std::string::npos ? "" : listen.substr(colon + 1);
  if (colon == 0 || port.empty() || port.size() > 5 || port.find_first_not_of("0123456789") != std::string::npos ||
      std::stoi(port) > 65535)
    throw Error(ErrorKind::BadInput, fmt::format("address '{}': expected HOST:PORT, e.g. 127.0.0.1:8080", listen));
  return {listen.substr(0, colon), std::stoi(port)};
}

void answer_json(httplib::Response& res, const Json& value, int status = 200) {
  res.status = status;
  // Bytes of other encodings in error texts must not spoil the answer.
  res.set_content(value.dump(-1, ' ', false, Json::error_handler_t::replace), "application/json");
}

Parameters parameters_of(const httplib::Request& req) { return {req.params.begin(), req.params.end()}; }

void serve_file(httplib::Response& res, const fs::path& file) {
  res.set_content_provider(
      fs::file_size(file), content_type(file), [file](std::size_t offset, std::size_t length, httplib::DataSink& sink) {
        const std::string part = read_part(file, offset, std::min<std::size_t>(length, 256 * 1024));
        return !part.empty() && sink.write(part.data(), part.size());
      });
}

}  // namespace

class HttpServer::Impl {
 public:
  Impl(const std::string& listen, fs::path state_dir, FarmControl control)
      : state_dir_(std::move(state_dir)), control_(std::move(control)) {
    server_.new_task_queue = [] { return new httplib::ThreadPool(kNumThreads); };
    server_.set_tcp_nodelay(true);
    server_.set_keep_alive_max_count(1000);
    server_.set_keep_alive_timeout(2);  // stopping waits for idle connections this long
    server_.set_default_headers(
        {{"X-Content-Type-Options", "nosniff"},
         {"Content-Security-Policy",
          "default-src 'self' data:; style-src 'self' 'unsafe-inline'; frame-ancestors 'self'"}});
    add_page();
    add_reads();
    add_writes();
    bind(parse_address(listen));
    thread_ = std::thread([this] { server_.listen_after_bind(); });
    while (!server_.is_running())
      std::this_thread::sleep_for(std::chrono::milliseconds(1));  // stop() before has no effect
  }

  ~Impl() {
    stopping_ = true;
    server_.stop();
    thread_.join();
  }

  const std::string& url() const { return url_; }

 private:
  using Handler = std::function<void(const httplib::Request&, httplib::Response&)>;

  void bind(const Address& address) {
    const int port = address.port == 0                                  ? server_.bind_to_any_port(address.host)
                     : server_.bind_to_port(address.host, address.port) ? address.port
                                                                        : -1;
    if (port <= 0)
      throw Error(ErrorKind::BadInput, fmt::format("cannot listen on {}:{}: the address is taken or not this machine's",
                                                   address.host, address.port));
    url_ = fmt::format("http://{}:{}", address.host, port);
  }

  /// The one place where what handlers throw becomes an answer.
  static Handler guarded(Handler handler) {
    return [handler = std::move(handler)](const httplib::Request& req, httplib::Response& res) {
      try {
        handler(req, res);
      } catch (const NotFound& e) {
        answer_json(res, {{"error", e.what()}}, 404);
      } catch (const Error& e) {
        answer_json(res, {{"error", e.what()}}, e.kind() == ErrorKind::BadInput ? 400 : 500);
      } catch (const std::exception& e) {
        answer_json(res, {{"error", e.what()}}, 500);
      }
    };
  }
  void get(const std::string& pattern, Handler handler) { server_.Get(pattern, guarded(std::move(handler))); }

  void add_page() {
    for (const WebFile& file : web_files()) {
      const auto serve = [file](const httplib::Request&, httplib::Response& res) {
        res.set_header("Cache-Control", "no-cache");
        res.set_content(file.bytes.data(), file.bytes.size(), content_type(fs::path(file.path)));
      };
      get(std::string(file.path), serve);
      if (file.path == "/index.html") get("/", serve);
    }
  }

  void add_reads() {
    get("/api/v1/jobs/([0-9]{1,18})/log", [this](const auto& req, auto& res) { answer_log(req, res); });
    get("/api/v1/jobs/([0-9]{1,18})/preview", [this](const auto& req, auto& res) {
      const fs::path picture = FarmQueries(state_dir_).preview_path(std::stoll(req.matches[1]));
      if (picture.empty()) throw NotFound("the job has no picture");
      res.set_header("Cache-Control", "max-age=86400");  // the page asks by key, and what a key names never changes
      serve_file(res, picture);
    });
    get("/api/v1/shots/([0-9]{1,18})/((?:out|\\.vantage/store)/.+)", [this](const auto& req, auto& res) {
      const fs::path file =
          servable_file(FarmQueries(state_dir_).shot_folder(std::stoll(req.matches[1])), req.matches[2]);
      if (file.empty()) throw NotFound("the shot has no file " + req.matches[2].str());
      // A report carries its styles inside and is made of escaped text.
      serve_file(res, file);
    });
    get("/api/v1/events", [this](const auto&, auto& res) { stream_events(res); });
    get("/api/v1(/.*)", [this](const auto& req, auto& res) {
      FarmQueries queries(state_dir_);
      answer_json(res, api_get(queries, req.matches[1], parameters_of(req)));
    });
  }

  void answer_log(const httplib::Request& req, httplib::Response& res) const {
    FarmQueries queries(state_dir_);
    const Parameters p = parameters_of(req);
    const auto attempt = integer_parameter(p, "attempt", -1);
    const fs::path log = queries.log_path(std::stoll(req.matches[1]),
                                          attempt < 0 ? std::nullopt : std::optional<int>(static_cast<int>(attempt)));
    std::error_code none;
    const std::uintmax_t size = log.empty() ? 0 : fs::file_size(log, none);
    if (log.empty() || none) throw NotFound("the job has no log yet");
    auto offset = static_cast<std::uintmax_t>(std::max<std::int64_t>(0, integer_parameter(p, "offset", 0)));
    const auto tail = static_cast<std::uintmax_t>(std::max<std::int64_t>(0, integer_parameter(p, "tail", 0)));
    if (tail > 0 && size > tail) offset = std::max(offset, size - tail);
    res.set_header("X-Log-Size", std::to_string(size));
    res.set_content(read_part(log, offset, kMaxLogBytes), "text/plain; charset=utf-8");
  }

  void stream_events(httplib::Response& res) {
    if (num_streams_.fetch_add(1) >= kMaxStreams) {
      --num_streams_;
      return answer_json(res, {{"error", "too many open event streams"}}, 503);
    }
    auto queries = std::make_shared<FarmQueries>(state_dir_);
    res.set_header("Cache-Control", "no-store");
    res.set_chunked_content_provider(
        "text/event-stream",
        [this, queries, seen = std::int64_t{-1}](std::size_t, httplib::DataSink& sink) mutable {
          return next_event(*queries, seen, sink);
        },
        [this](bool) { --num_streams_; });
  }

  /// Waits for a change, or a while, then writes one event or comment. False ends the stream.
  bool next_event(FarmQueries& queries, std::int64_t& seen, httplib::DataSink& sink) const {
    for (int beat = 0; beat < kBeatsPerComment; ++beat) {
      if (stopping_) return false;
      const std::int64_t version = queries.data_version();
      if (version != seen) {
        seen = version;
        const std::string event = fmt::format("event: changed\ndata: {}\n\n", version);
        if (!sink.write(event.data(), event.size())) return false;
        std::this_thread::sleep_for(kStreamBeat);
        return true;
      }
      std::this_thread::sleep_for(kStreamBeat);
    }
    return sink.write(": still here\n\n", 14);
  }

  void post(const std::string& pattern, std::function<Json(const httplib::Request&)> handler) {
    server_.Post(pattern, guarded([handler = std::move(handler)](const httplib::Request& req, httplib::Response& res) {
                   if (!req.has_header("X-Vantage"))
                     throw Error(ErrorKind::BadInput, "a POST needs the header X-Vantage: 1");
                   answer_json(res, handler(req));
                 }));
  }

  void add_writes() {
    post("/api/v1/shots", [this](const httplib::Request& req) { return submit(req.body); });
    post("/api/v1/(shots|jobs)/([0-9]{1,18})/([a-z]+)", [this](const httplib::Request& req) {
      Command command{.verb = verb_of(req.matches[3]), .shot = {}, .job = {}, .worker = {}, .priority = 0};
      const std::int64_t id = std::stoll(req.matches[2]);
      if (req.matches[1] == "jobs")
        command.job = JobId{id};
      else
        command.shot = ShotId{id};
      const CommandResult result = control_.command(command);
      return Json{{"num_changed", result.num_changed}, {"text", result.text}};
    });
  }

  Json submit(const std::string& body) const {
    const Json request = Json::parse(body, nullptr, false);
    if (!request.is_object() || !request.contains("folder") || !request.at("folder").is_string())
      throw Error(ErrorKind::BadInput,
                  "the body must be JSON: {\"folder\": \"/absolute/path\", \"until\": \"\", \"priority\": 0}");
    const SubmitResult result = control_.submit({.folder = request.at("folder").get<std::string>(),
                                                 .until_kind = request.value("until", ""),
                                                 .priority = request.value("priority", 0)});
    return {{"shot", result.shot.value},
            {"generation", result.generation},
            {"num_jobs", result.num_jobs},
            {"num_up_to_date", result.num_up_to_date}};
  }

  static Command::Verb verb_of(const std::string& word) {
    using enum Command::Verb;
    static const std::map<std::string, Command::Verb> verbs{
        {"pause", Pause}, {"resume", Resume}, {"cancel", Cancel}, {"retry", Retry}};
    const auto found = verbs.find(word);
    if (found == verbs.end())
      throw NotFound(fmt::format("there is no action '{}': pause, resume, cancel or retry", word));
    return found->second;
  }

  fs::path state_dir_;
  FarmControl control_;
  httplib::Server server_;
  std::thread thread_;
  std::string url_;
  std::atomic<bool> stopping_{false};
  mutable std::atomic<int> num_streams_{0};
};

HttpServer::HttpServer(const std::string& listen, fs::path state_dir, FarmControl control)
    : impl_(std::make_unique<Impl>(listen, std::move(state_dir), std::move(control))) {}
HttpServer::~HttpServer() = default;
const std::string& HttpServer::url() const { return impl_->url(); }

}  // namespace vantage

#include "scheduler/api/http_server.h"

#include <fmt/format.h>

#include <thread>

#include "scheduler/api/files.h"
#include "web/web_files.h"

namespace vantage {
namespace fs = std::filesystem;
namespace {

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

/// "a=1; vantage_8080=…" -> "…"
std::string cookie_of(const httplib::Request& req, const std::string& name) {
  const std::string all = "; " + req.get_header_value("Cookie");
  const auto start = all.find("; " + name + "=");
  if (start == std::string::npos) return {};
  const auto from = start + name.size() + 3;
  return all.substr(from, all.find(';', from) - from);
}

const WebFile* find_page_file(const std::string& path) {
  const std::string_view wanted = path == "/" ? "/index.html" : std::string_view(path);
  for (const WebFile& file : web_files())
    if (file.path == wanted) return &file;
  return nullptr;
}

void serve_page_file(const WebFile& file, httplib::Response& res) {
  res.set_header("Cache-Control", "no-cache");
  res.set_content(file.bytes.data(), file.bytes.size(), content_type(fs::path(file.path)));
}

/// For answers that httplib makes itself.
void explain(const httplib::Request&, httplib::Response& res) {
  if (!res.body.empty() || res.content_length_ > 0 || res.content_provider_) return;
  answer_json(res, {{"error", fmt::format("HTTP status {}", res.status)}}, res.status);
}

constexpr const char* kContentPolicy =
    "default-src 'self' data:; style-src 'self' 'unsafe-inline'; frame-ancestors 'self'";

}  // namespace

class HttpServer::Impl {
 public:
  explicit Impl(Options options)
      : options_(std::move(options)),
        gate_(options_.state_dir, parse_address(options_.listen).host),
        server_(options_.limits) {
    bind(parse_address(options_.listen));
    handlers_ = std::make_unique<Handlers>(Handlers::Context{.state_dir = options_.state_dir,
                                                             .control = options_.control,
                                                             .limits = options_.limits,
                                                             .gate = &gate_,
                                                             .server = &server_,
                                                             .counts = &counts_,
                                                             .cookie = cookie_});
    server_.set_default_headers({{"X-Content-Type-Options", "nosniff"},
                                 {"Referrer-Policy", "no-referrer"},
                                 {"Content-Security-Policy", kContentPolicy}});
    server_.set_error_handler(httplib::Server::Handler(explain));
    server_.set_pre_routing_handler([this](const auto& req, auto& res) { return before_body(req, res); });
    server_.Post(".*", [this](const auto& req, auto& res) { answer(req, res, /*has_body=*/true); });
    thread_ = std::thread([this] { server_.listen_after_bind(); });
    while (!server_.is_running())
      std::this_thread::sleep_for(std::chrono::milliseconds(1));  // stop() before has no effect
  }

  ~Impl() {
    server_.stop_waiting();
    server_.stop();
    thread_.join();
  }

  const std::string& url() const { return url_; }
  std::string page_url() const {
    const std::string token = gate_.operator_token();
    return token.empty() ? url_ : fmt::format("{}/#token={}", url_, token);
  }

 private:
  void bind(const Address& address) {
    const int port = address.port == 0                                  ? server_.bind_to_any_port(address.host)
                     : server_.bind_to_port(address.host, address.port) ? address.port
                                                                        : -1;
    if (port <= 0)
      throw Error(ErrorKind::BadInput, fmt::format("cannot listen on {}:{}: the address is taken or not this machine's",
                                                   address.host, address.port));
    url_ = fmt::format("http://{}:{}", address.host, port);
    cookie_ = fmt::format("vantage_{}", port);
  }

  /// All but the handling of a POST happens before its body is read: who may not, cannot make us read it.
  httplib::Server::HandlerResponse before_body(const httplib::Request& req, httplib::Response& res) {
    return answer(req, res, /*has_body=*/false) ? httplib::Server::HandlerResponse::Handled
                                                : httplib::Server::HandlerResponse::Unhandled;
  }

  /// False when the body is needed first. The one place where what handlers throw becomes an answer.
  bool answer(const httplib::Request& req, httplib::Response& res, bool has_body) {
    const auto start = std::chrono::steady_clock::now();
    std::string name = "none";
    try {
      if (!try_answer(req, res, has_body, name)) return false;
    } catch (const NotFound& e) {
      answer_json(res, {{"error", e.what()}}, 404);
    } catch (const KeyReused& e) {
      answer_json(res, {{"error", e.what()}}, 422);
    } catch (const Error& e) {
      answer_json(res, {{"error", e.what()}}, e.kind() == ErrorKind::BadInput ? 400 : 500);
    } catch (const std::exception& e) {
      answer_json(res, {{"error", e.what()}}, 500);
    }
    counts_.add(name, res.status < 0 ? (req.ranges.empty() ? 200 : 206) : res.status,
                std::chrono::steady_clock::now() - start);
    return true;
  }

  bool try_answer(const httplib::Request& req, httplib::Response& res, bool has_body, std::string& name) {
    const std::string method = req.method == "HEAD" ? "GET" : req.method;
    const WebFile* file = method == "GET" ? find_page_file(req.path) : nullptr;
    Found found = find_route(method, req.path);
    name = file != nullptr ? "page" : found.route != nullptr ? found.route->name : "none";
    auto pass = gate_.check(caller_of(req), found.route != nullptr ? found.route->access : Access::Open);
    if (const auto* refused = std::get_if<Refused>(&pass)) return turn_away(*refused, res), true;
    if (file != nullptr) return serve_page_file(*file, res), true;
    if (found.route == nullptr) return say_what_is_wrong(found, req, res), true;
    if (method == "POST" && !has_body) return !is_json(req) && (say_wrong_type(req, res), true);
    const Call call{.path = std::move(found.path),
                    .parameters = {req.params.begin(), req.params.end()},
                    .pass = std::get<Pass>(pass),
                    .request = &req};
    run(*found.route, call, res);
    return true;
  }

  void run(const Route& route, const Call& call, httplib::Response& res) {
    if (route.handle != nullptr) return (handlers_.get()->*route.handle)(call, res);
    FarmQueries queries(options_.state_dir);
    answer_json(res, route.read(queries, call));
  }

  Caller caller_of(const httplib::Request& req) const {
    return {.peer_ip = req.remote_addr,
            .own_ip = req.local_addr,
            .host = req.get_header_value("Host"),
            .authorization = req.get_header_value("Authorization"),
            .session = cookie_of(req, cookie_),
            .forwarded = req.has_header("Forwarded") || req.has_header("X-Forwarded-For") || req.has_header("Via")};
  }

  static void turn_away(const Refused& refused, httplib::Response& res) {
    if (refused.status == 401) res.set_header("WWW-Authenticate", "Bearer realm=\"vantage\"");
    answer_json(res, {{"error", refused.why}}, refused.status);
  }

  static void say_what_is_wrong(const Found& found, const httplib::Request& req, httplib::Response& res) {
    if (found.allowed.empty()) throw NotFound("there is no " + req.path);
    res.set_header("Allow", found.allowed);
    answer_json(res, {{"error", fmt::format("{} takes {}, not {}", req.path, found.allowed, req.method)}}, 405);
  }

  /// A form on another site's page cannot send this type without asking us first.
  static bool is_json(const httplib::Request& req) {
    const std::string type = req.get_header_value("Content-Type");
    return type.empty() || type.starts_with("application/json");
  }
  static void say_wrong_type(const httplib::Request& req, httplib::Response& res) {
    const std::string type = req.get_header_value("Content-Type");
    answer_json(res, {{"error", fmt::format("Content-Type is {}, expected application/json", type)}}, 415);
  }

  Options options_;
  Gate gate_;
  HttpCounts counts_;
  LimitedServer server_;
  std::unique_ptr<Handlers> handlers_;
  std::string url_, cookie_;
  std::thread thread_;
};

HttpServer::HttpServer(Options options) : impl_(std::make_unique<Impl>(std::move(options))) {}
HttpServer::~HttpServer() = default;
const std::string& HttpServer::url() const { return impl_->url(); }
std::string HttpServer::page_url() const { return impl_->page_url(); }

FarmControl control_of(FarmScheduler& farm) {
  return {.submit = [&farm](SubmitRequest request,
                            OnceKey once) { return farm.submit(std::move(request), std::move(once)).get(); },
          .command = [&farm](Command command,
                             OnceKey once) { return farm.command(std::move(command), std::move(once)).get(); },
          .state =
              [&farm] {
                return FarmState{.health = farm.health(),
                                 .stats = farm.stats(),
                                 .drops = farm.dropped_messages(),
                                 .broker = farm.broker_counts()};
              }};
}

}  // namespace vantage

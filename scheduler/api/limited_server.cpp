#include "scheduler/api/limited_server.h"

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

namespace vantage {
namespace {

/// Beyond one for each connection, so that there is always one to say that there are too many.
constexpr std::size_t kThreadsToRefuse = 4;

}  // namespace

LimitedServer::LimitedServer(const HttpLimits& limits) : limits_(limits) {
  new_task_queue = [num = static_cast<std::size_t>(limits.max_connections) + kThreadsToRefuse] {
    return new httplib::ThreadPool(num);
  };
  set_tcp_nodelay(true);
  // httplib's own choice, SO_REUSEPORT, would let a second scheduler take half of the first one's requests.
  set_socket_options([](socket_t socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  set_payload_max_length(limits.max_body_bytes);
}

std::optional<EarlyAnswer> LimitedServer::admit(const std::string& address) {
  const std::lock_guard lock(mutex_);
  if (num_connections_ >= limits_.max_connections) {
    count(Refusal::TooManyConnections);
    return EarlyAnswer{503, fmt::format("{} connections are open, more are not taken", limits_.max_connections)};
  }
  if (num_by_address_[address] >= limits_.max_per_address) {
    count(Refusal::TooManyOfAddress);
    return EarlyAnswer{
        429, fmt::format("{} connections from {} are open, more are not taken", limits_.max_per_address, address)};
  }
  ++num_connections_;
  ++num_by_address_[address];
  return std::nullopt;
}

void LimitedServer::leave(const std::string& address) {
  const std::lock_guard lock(mutex_);
  --num_connections_;
  if (--num_by_address_[address] == 0) num_by_address_.erase(address);
}

bool LimitedServer::process_and_close_socket(socket_t socket) {
  const std::string address = address_of_peer(socket);
  Connection connection(socket, limits_, stopping_);
  if (const auto answer = admit(address)) {
    const std::string text = early_answer_text(*answer);
    connection.write(text.data(), text.size());
  } else {
    serve(connection);
    leave(address);
  }
  shutdown(socket, SHUT_RDWR);
  close(socket);
  return true;
}

void LimitedServer::serve(Connection& connection) {
  for (int num_left = limits_.max_requests_per_connection; num_left > 0 && !stopping_; --num_left) {
    const Connection::Next next = connection.await_request();
    if (next == Connection::Next::Refused) count(Refusal::BadHead);
    if (next != Connection::Next::Request) return;
    bool closed = false;
    const bool ok = process_request(connection, /*close_connection=*/num_left == 1, closed, nullptr);
    if (!connection.at_end_of_request()) return connection.linger();
    if (!ok || closed) return;
  }
}

}  // namespace vantage

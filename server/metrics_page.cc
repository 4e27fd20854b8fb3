#include "server/metrics_page.h"

// Not prometheus-cpp's own exposer: the web server in it starts its threads with stacks of 100 KiB, which
// glibc refuses in a process whose libraries, LibTorch's among them, need more than that for thread-local
// variables.

#include <fmt/format.h>
#include <netdb.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>
#include <utility>

namespace stance {
namespace {

constexpr size_t kMaxRequest = 8192;
constexpr int kAcceptPauseMilliseconds = 100;

// One peer's connection, which does not block. Everything with it together has to be done by the deadline.
class Peer {
 public:
  // Neither descriptor is owned. `stopper` becomes readable when the page ends.
  Peer(int connection, int stopper, TimePoint deadline)
      : connection_(connection), stopper_(stopper), deadline_(deadline) {}

  // The request's head, as far as it came.
  std::string ReadHead() const {
    std::string head;
    char buffer[1024];
    while (head.size() < kMaxRequest && head.find("\r\n\r\n") == std::string::npos && Await(POLLIN)) {
      const ssize_t got = recv(connection_, buffer, sizeof(buffer), 0);
      if (got < 0 && IsPassing(errno)) continue;
      if (got <= 0) break;
      head.append(buffer, static_cast<size_t>(got));
    }
    return head;
  }

  void SendAll(const std::string& text) const {
    for (size_t sent = 0; sent < text.size() && Await(POLLOUT);) {
      const ssize_t count = send(connection_, text.data() + sent, text.size() - sent, MSG_NOSIGNAL);
      if (count < 0 && IsPassing(errno)) continue;
      if (count <= 0) return;
      sent += static_cast<size_t>(count);
    }
  }

 private:
  static bool IsPassing(int error) { return error == EAGAIN || error == EWOULDBLOCK || error == EINTR; }

  // True once the connection is ready for `event`; false at the deadline and at the end of the page.
  bool Await(int16_t event) const {
    while (true) {
      const auto left = std::chrono::ceil<std::chrono::milliseconds>(deadline_ - RealClock().Now()).count();
      if (left <= 0) return false;
      pollfd events[] = {{connection_, event, 0}, {stopper_, POLLIN, 0}};
      const int ready = poll(events, 2, static_cast<int>(std::min<int64_t>(left, INT_MAX)));
      if (ready < 0 && errno != EINTR) return false;
      if (ready > 0) return events[1].revents == 0;
    }
  }

  const int connection_;
  const int stopper_;
  const TimePoint deadline_;
};

int PortOf(int listener) {
  sockaddr_storage bound{};
  socklen_t size = sizeof(bound);
  getsockname(listener, reinterpret_cast<sockaddr*>(&bound), &size);
  return ntohs(bound.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(bound).sin6_port
                                           : reinterpret_cast<const sockaddr_in&>(bound).sin_port);
}

// A socket that listens on one of the resolved addresses, or -1 with errno.
int Listen(const addrinfo* addresses) {
  for (const addrinfo* at = addresses; at != nullptr; at = at->ai_next) {
    // It must not block: a peer may have gone between poll and accept.
    const int listener = socket(at->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (listener < 0) continue;
    const int on = 1;
    setsockopt(listener, SOL_SOCKET, SO_REUSEADDR, &on, sizeof(on));
    if (bind(listener, at->ai_addr, at->ai_addrlen) == 0 && listen(listener, 16) == 0) return listener;
    const int error = errno;
    close(listener);
    errno = error;
  }
  return -1;
}

}  // namespace

absl::StatusOr<std::unique_ptr<MetricsPage>> MetricsPage::Serve(const std::string& address,
                                                                std::function<std::string()> body,
                                                                Duration patience) {
  const size_t colon = address.rfind(':');
  if (colon == std::string::npos) {
    return absl::InvalidArgumentError(fmt::format("'{}' is not HOST:PORT", address));
  }
  std::string host = address.substr(0, colon);
  if (host.size() >= 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE | AI_NUMERICSERV;
  addrinfo* addresses = nullptr;
  const int error =
      getaddrinfo(host.empty() ? nullptr : host.c_str(), address.c_str() + colon + 1, &hints, &addresses);
  if (error != 0) {
    return absl::InvalidArgumentError(fmt::format("'{}' is not HOST:PORT: {}", address, gai_strerror(error)));
  }
  const int listener = Listen(addresses);
  const int cause = errno;
  freeaddrinfo(addresses);
  if (listener < 0) {
    return absl::UnavailableError(fmt::format("{} can't be bound: {}", address, std::strerror(cause)));
  }
  const int stopper = eventfd(0, EFD_CLOEXEC);
  return std::unique_ptr<MetricsPage>(
      new MetricsPage(listener, stopper, PortOf(listener), std::move(body), patience));
}

MetricsPage::MetricsPage(int listener, int stopper, int port, std::function<std::string()> body,
                         Duration patience)
    : listener_(listener),
      stopper_(stopper),
      port_(port),
      body_(std::move(body)),
      patience_(patience),
      thread_([this] { Loop(); }) {}

MetricsPage::~MetricsPage() {
  eventfd_write(stopper_, 1);
  thread_.join();
  close(listener_);
  close(stopper_);
}

void MetricsPage::Loop() {
  pollfd events[] = {{listener_, POLLIN, 0}, {stopper_, POLLIN, 0}};
  while (true) {
    if (poll(events, 2, -1) < 0) {
      if (errno != EINTR) return;
      continue;
    }
    if (events[1].revents != 0) return;
    if (events[0].revents == 0) continue;
    const int connection = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
    if (connection < 0) {
      // Without a free descriptor the connection stays where it is and poll would return at once, again and
      // again.
      poll(&events[1], 1, kAcceptPauseMilliseconds);
      continue;
    }
    Answer(connection);
    close(connection);
  }
}

void MetricsPage::Answer(int connection) const {
  const Peer peer(connection, stopper_, RealClock().Now() + patience_);
  const std::string head = peer.ReadHead();
  std::string status = "200 OK", text;
  if (!head.starts_with("GET ")) {
    status = "405 Method Not Allowed";
  } else if (head.starts_with("GET /metrics ") || head.starts_with("GET /metrics?")) {
    text = body_();
  } else {
    status = "404 Not Found";
  }
  peer.SendAll(
      fmt::format("HTTP/1.1 {}\r\nContent-Type: text/plain; version=0.0.4; charset=utf-8\r\n"
                  "Content-Length: {}\r\nConnection: close\r\n\r\n{}",
                  status, text.size(), text));
  shutdown(connection, SHUT_WR);
}

}  // namespace stance

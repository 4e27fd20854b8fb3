#include "server/metrics_page.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <future>
#include <memory>
#include <thread>

namespace stance {
namespace {

using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

// A connection to the page; closed at the end.
class Connection {
 public:
  explicit Connection(int port) {
    sockaddr_in target{};
    target.sin_family = AF_INET;
    target.sin_port = htons(static_cast<uint16_t>(port));
    target.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(socket_, reinterpret_cast<sockaddr*>(&target), sizeof(target)), 0);
  }
  ~Connection() { close(socket_); }

  void Send(const std::string& text) { EXPECT_TRUE(TrySend(text)); }
  // False once the page has closed the connection.
  bool TrySend(const std::string& text) {
    return send(socket_, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  }
  std::string ReceiveAll() {
    std::string text;
    char buffer[4096];
    for (ssize_t got; (got = recv(socket_, buffer, sizeof(buffer), 0)) > 0;) {
      text.append(buffer, static_cast<size_t>(got));
    }
    return text;
  }

 private:
  const int socket_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
};

std::string Ask(int port, const std::string& request) {
  Connection connection(port);
  connection.Send(request);
  return connection.ReceiveAll();
}

constexpr char kGet[] = "GET /metrics HTTP/1.1\r\n\r\n";
// More than the kernel takes for a peer that does not read.
constexpr size_t kLarge = size_t{32} << 20;

std::unique_ptr<MetricsPage> ServeText(std::string text, Duration patience = std::chrono::seconds(2)) {
  auto page = MetricsPage::Serve(
      "127.0.0.1:0", [text = std::move(text)] { return text; }, patience);
  EXPECT_TRUE(page.ok()) << page.status();
  return *std::move(page);
}

TEST(MetricsPageTest, AnswersTheMetricsOnly) {
  const auto page = ServeText("hello\n");
  const std::string good = Ask(page->port(), "GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_THAT(good, StartsWith("HTTP/1.1 200 OK\r\n"));
  EXPECT_THAT(good, HasSubstr("Content-Length: 6\r\n"));
  EXPECT_THAT(good, EndsWith("\r\n\r\nhello\n"));
  EXPECT_THAT(Ask(page->port(), "GET / HTTP/1.1\r\n\r\n"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(Ask(page->port(), "GET /metricsx HTTP/1.1\r\n\r\n"), StartsWith("HTTP/1.1 404"));
  EXPECT_THAT(Ask(page->port(), "POST /metrics HTTP/1.1\r\n\r\n"), StartsWith("HTTP/1.1 405"));
}

TEST(MetricsPageTest, SurvivesPeersThatMisbehave) {
  const auto page = ServeText(std::string(kLarge, 'x'), std::chrono::seconds(1));
  { Connection hangs_up(page->port()); }
  Connection says_nothing(page->port());
  Connection never_reads(page->port());
  never_reads.Send(kGet);
  Connection asks_too_much(page->port());
  asks_too_much.TrySend(std::string(8192, 'y'));
  // The next peer's turn, while the others are still connected. Its answer may be cut where this machine is
  // slow.
  EXPECT_THAT(Ask(page->port(), kGet), StartsWith("HTTP/1.1 200 OK\r\n"));
}

// Every byte restarts a limit that counts from the last one.
TEST(MetricsPageTest, ADrippingPeerIsDroppedAtItsDeadline) {
  const auto page = ServeText("hello\n", std::chrono::milliseconds(100));
  Connection dripping(page->port());
  std::atomic<int> bytes = 0;
  std::jthread drip([&](const std::stop_token& stop) {
    while (!stop.stop_requested() && dripping.TrySend("y")) {
      ++bytes;
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
  });
  EXPECT_THAT(Ask(page->port(), kGet), EndsWith("hello\n"));
  EXPECT_LT(bytes, 8192) << "the page read all that it accepts";
}

// With an hour's patience, these tests end only if the destructor does not wait for the peers.
TEST(MetricsPageTest, EndsWhileAPeerSaysNothing) {
  const auto page = ServeText("hello\n", std::chrono::hours(1));
  Connection waits(page->port());
  waits.Send("GET /met");
}

TEST(MetricsPageTest, EndsWhileAPeerDoesNotRead) {
  std::promise<void> asked;
  auto page = MetricsPage::Serve(
      "127.0.0.1:0",
      [&asked] {
        asked.set_value();
        return std::string(kLarge, 'x');
      },
      std::chrono::hours(1));
  ASSERT_TRUE(page.ok()) << page.status();
  Connection never_reads((*page)->port());
  never_reads.Send(kGet);
  asked.get_future().wait();
}

TEST(MetricsPageTest, RefusesAddressesThatCannotBeBound) {
  const auto page = ServeText("");
  const auto body = [] { return std::string(); };
  EXPECT_EQ(MetricsPage::Serve("127.0.0.1:" + std::to_string(page->port()), body).status().code(),
            absl::StatusCode::kUnavailable);
  for (const char* address : {"", "9464", "127.0.0.1:many"}) {
    const absl::Status status = MetricsPage::Serve(address, body).status();
    EXPECT_EQ(status.code(), absl::StatusCode::kInvalidArgument) << address;
    EXPECT_THAT(std::string(status.message()), HasSubstr(std::string("'") + address + "'"));
  }
}

}  // namespace
}  // namespace stance

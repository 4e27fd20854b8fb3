#include "server/metrics_page.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

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

  void Send(const std::string& text) {
    EXPECT_EQ(send(socket_, text.data(), text.size(), MSG_NOSIGNAL), static_cast<ssize_t>(text.size()));
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

std::unique_ptr<MetricsPage> ServeText(std::string text) {
  auto page = MetricsPage::Serve("127.0.0.1:0", [text = std::move(text)] { return text; });
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
  const auto page = ServeText(std::string(1 << 20, 'x'));
  { Connection says_nothing(page->port()); }
  {
    Connection never_reads(page->port());
    never_reads.Send("GET /metrics HTTP/1.1\r\n\r\n");
  }
  Ask(page->port(), std::string(8192, 'y'));
  EXPECT_THAT(Ask(page->port(), "GET /metrics HTTP/1.1\r\n\r\n"), EndsWith("xxx"));
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

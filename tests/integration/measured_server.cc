#include "tests/integration/measured_server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <thread>

namespace stance::testing {
namespace {

// The text after `before` up to the next of `ends`; empty if `before` does not occur.
std::string TextAfter(const std::string& text, const std::string& before, const char* ends) {
  const size_t start = text.find(before);
  if (start == std::string::npos) return "";
  const size_t from = start + before.size();
  return text.substr(from, text.find_first_of(ends, from) - from);
}

// What http://`address`/metrics answers with, headers included.
std::string GetMetrics(const std::string& address) {
  const size_t colon = address.rfind(':');
  if (colon == std::string::npos) return "";
  sockaddr_in target{};
  target.sin_family = AF_INET;
  target.sin_port = htons(static_cast<uint16_t>(std::stoi(address.substr(colon + 1))));
  inet_pton(AF_INET, address.substr(0, colon).c_str(), &target.sin_addr);
  const int connection = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::string answer;
  if (connect(connection, reinterpret_cast<sockaddr*>(&target), sizeof(target)) == 0) {
    const std::string request = "GET /metrics HTTP/1.0\r\nConnection: close\r\n\r\n";
    EXPECT_EQ(write(connection, request.data(), request.size()), static_cast<ssize_t>(request.size()));
    char buffer[4096];
    for (ssize_t got; (got = read(connection, buffer, sizeof(buffer))) > 0;) {
      answer.append(buffer, static_cast<size_t>(got));
    }
  }
  close(connection);
  return answer;
}

}  // namespace

std::unique_ptr<MeasuredServer> MeasuredServer::Start(const std::vector<std::string>& arguments,
                                                      const std::string& model) {
  std::unique_ptr<MeasuredServer> server(new MeasuredServer(arguments, model));
  if (server->address().empty()) return nullptr;
  return server;
}

// The address stands in the log, which is JSON: "metrics":"127.0.0.1:1234".
std::string MeasuredServer::Page() const { return GetMetrics(TextAfter(Log(), "\"metrics\":\"", "\"")); }

double MeasuredServer::Metric(const std::string& name) const {
  const std::string value = TextAfter(Page(), "\n" + name + " ", "\r\n");
  return value.empty() ? -1 : std::atof(value.c_str());
}

void MeasuredServer::AwaitMetric(const std::string& name, double at_least) const {
  const auto give_up = std::chrono::steady_clock::now() + std::chrono::minutes(1);
  while (Metric(name) < at_least) {
    ASSERT_LT(std::chrono::steady_clock::now(), give_up) << name << " is " << Metric(name) << "\n" << Log();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
}

}  // namespace stance::testing

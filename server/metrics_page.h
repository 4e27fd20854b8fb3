// A page over HTTP: the little of a web server that a metrics scraper needs.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "core/base/clock.h"
#include "core/base/status.h"

namespace stance {

// Answers GET /metrics with the text of `body`, one connection after the other, on a thread of its own that
// sleeps while nobody asks. A peer that has not sent its request and taken its answer within `patience` is
// dropped, so that it delays the next one by no more; destruction waits for no peer.
class MetricsPage {
 public:
  // Listens on HOST:PORT ("127.0.0.1:9464", "[::1]:0", a name); port 0 picks a free one. INVALID_ARGUMENT for
  // an address that isn't one, UNAVAILABLE for one that can't be bound; the text holds it. `body` is called
  // on the page's thread.
  static absl::StatusOr<std::unique_ptr<MetricsPage>> Serve(const std::string& address,
                                                            std::function<std::string()> body,
                                                            Duration patience = std::chrono::seconds(2));
  ~MetricsPage();

  int port() const { return port_; }

 private:
  MetricsPage(int listener, int stopper, int port, std::function<std::string()> body, Duration patience);

  void Loop();
  void Answer(int connection) const;

  const int listener_;  // owned, as is stopper_, an eventfd that becomes readable at the end
  const int stopper_;
  const int port_;
  const std::function<std::string()> body_;
  const Duration patience_;
  std::jthread thread_;
};

}  // namespace stance

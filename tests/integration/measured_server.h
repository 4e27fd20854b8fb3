// A real server whose metrics a test can read.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "tests/support/server_process.h"

namespace stance::testing {

class MeasuredServer : public ServerProcess {
 public:
  // Null, with a test failure, if the server did not start.
  static std::unique_ptr<MeasuredServer> Start(const std::vector<std::string>& arguments = {},
                                               const std::string& model = STANCE_UNTRAINED_MODEL);

  // The value of one line of /metrics, e.g. `stance_running_requests`; -1 if there is none.
  double Metric(const std::string& name) const;

  // The whole page, headers included.
  std::string Page() const;

  // Waits until that line has at least that value; fails the test after a minute.
  void AwaitMetric(const std::string& name, double at_least) const;

 private:
  using ServerProcess::ServerProcess;
};

}  // namespace stance::testing

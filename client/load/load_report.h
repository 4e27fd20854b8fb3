// What a load run measured.
#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "client/load/log_histogram.h"

namespace stance {

// A plain value; not thread-safe.
struct LoadReport {
  std::string mode;  // "open" or "closed"
  double rate = 0;   // planned requests per second, open loop
  int64_t clients = 0;
  double seconds = 0;   // from the start to the last answer
  int64_t planned = 0;  // sent and unsent
  int64_t sent = 0;
  int64_t unsent = 0;
  LogHistogram latency;                   // of the successes, from the planned time, nanoseconds
  LogHistogram send_delay;                // planned to really sent, nanoseconds
  std::map<std::string, int64_t> errors;  // by code, "UNAVAILABLE"

  // One answer: times in seconds since the start; `code` "OK" or the error's name.
  void Record(double planned_time, double sent_time, double answered_time, const std::string& code);

  int64_t succeeded() const { return latency.count(); }
  // Successes per second.
  double throughput() const;
};

// A few aligned lines for people.
std::string LoadReportText(const LoadReport& report);
// One object; latencies in milliseconds; docs/cli.md names the keys.
std::string LoadReportJson(const LoadReport& report);

}  // namespace stance

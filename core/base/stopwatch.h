// Elapsed wall time.
#pragma once

#include <chrono>

namespace stance {

class Stopwatch {
 public:
  // Seconds since construction or the last call, which it restarts from.
  double Lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

}  // namespace stance

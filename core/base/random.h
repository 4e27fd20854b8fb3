// Random numbers from an explicit seed: the same seed gives the same sequence on every platform.
#pragma once

#include <cstdint>

namespace stance {

// xoshiro256++ (Blackman and Vigna, 2019) seeded by splitmix64. A value type; not thread-safe.
class Random {
 public:
  explicit Random(uint64_t seed);

  // The generator of an independent stream: the same (seed, stream) gives the same numbers.
  Random(uint64_t seed, uint64_t stream);

  uint64_t Next();

  // Uniform in [low, high).
  double Uniform(double low = 0.0, double high = 1.0);

  // Uniform integer in [0, n). REQUIRES: n > 0.
  int64_t Below(int64_t n);

  // Normal with the given mean and standard deviation.
  double Normal(double mean = 0.0, double deviation = 1.0);

  // True with probability p.
  bool Chance(double p) { return Uniform() < p; }

 private:
  uint64_t state_[4];
  double spare_normal_ = 0.0;
  bool has_spare_normal_ = false;
};

}  // namespace stance

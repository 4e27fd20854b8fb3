#include "core/base/random.h"

#include <cmath>

#include "core/base/check.h"

namespace stance {
namespace {

uint64_t SplitMix64(uint64_t& state) {
  uint64_t z = (state += 0x9e3779b97f4a7c15ULL);
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

uint64_t RotateLeft(uint64_t x, int k) { return (x << k) | (x >> (64 - k)); }

}  // namespace

Random::Random(uint64_t seed) : Random(seed, 0) {}

Random::Random(uint64_t seed, uint64_t stream) {
  uint64_t mix = seed;
  mix = SplitMix64(mix) ^ (stream * 0xd1342543de82ef95ULL);
  for (uint64_t& word : state_) word = SplitMix64(mix);
}

uint64_t Random::Next() {
  const uint64_t result = RotateLeft(state_[0] + state_[3], 23) + state_[0];
  const uint64_t t = state_[1] << 17;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= t;
  state_[3] = RotateLeft(state_[3], 45);
  return result;
}

double Random::Uniform(double low, double high) {
  constexpr double kTwoToMinus53 = 0x1.0p-53;
  return low + (high - low) * (static_cast<double>(Next() >> 11) * kTwoToMinus53);
}

int64_t Random::Below(int64_t n) {
  STANCE_CHECK(n > 0);
  // The bias of the modulo is below n / 2^64: nothing that a sampler could see.
  return static_cast<int64_t>(Next() % static_cast<uint64_t>(n));
}

double Random::Normal(double mean, double deviation) {
  if (has_spare_normal_) {
    has_spare_normal_ = false;
    return mean + deviation * spare_normal_;
  }
  double u, v, s;  // Marsaglia's polar method
  do {
    u = Uniform(-1.0, 1.0);
    v = Uniform(-1.0, 1.0);
    s = u * u + v * v;
  } while (s >= 1.0 || s == 0.0);
  const double scale = std::sqrt(-2.0 * std::log(s) / s);
  spare_normal_ = v * scale;
  has_spare_normal_ = true;
  return mean + deviation * u * scale;
}

}  // namespace stance

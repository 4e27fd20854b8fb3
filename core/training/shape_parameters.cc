#include "core/training/shape_parameters.h"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace stance {
namespace {

// Spreads a value in [0, 1] linearly over `count` members at equal distances, written from `first` on.
void Interpolate(double value, int count, double* first) {
  const double position = std::clamp(value, 0.0, 1.0) * (count - 1);
  const int lower = std::min(static_cast<int>(position), count - 2);
  std::fill(first, first + count, 0.0);
  first[lower] = 1.0 - (position - lower);
  first[lower + 1] = position - lower;
}

// Gamma(shape) for shape < 1 (Ahrens and Dieter's GS, 1974): what a Dirichlet sample is made of.
double SampleGamma(Random& random, double shape) {
  const double b = 1.0 + shape / std::exp(1.0);
  while (true) {
    const double p = b * random.Uniform();
    const double u = random.Uniform();
    if (p <= 1.0) {
      const double x = std::pow(p, 1.0 / shape);
      if (u <= std::exp(-x)) return x;
    } else {
      const double x = -std::log((b - p) / shape);
      if (u <= std::pow(x, shape - 1.0)) return x;
    }
  }
}

}  // namespace

std::array<double, kShapeFactorCount> ShapeFactors(const ShapeParameters& parameters) {
  std::array<double, kShapeFactorCount> factors = {};
  factors[kMale] = std::clamp(parameters.gender, 0.0, 1.0);
  factors[kFemale] = 1.0 - factors[kMale];
  std::copy(parameters.ethnicity.begin(), parameters.ethnicity.end(), &factors[kAfrican]);
  Interpolate(parameters.age, 3, &factors[kChild]);
  Interpolate(parameters.muscle, 3, &factors[kMinMuscle]);
  Interpolate(parameters.weight, 3, &factors[kMinWeight]);
  Interpolate(parameters.height, 2, &factors[kMinHeight]);
  Interpolate(parameters.proportions, 2, &factors[kIdealProportions]);
  Interpolate(parameters.cup, 3, &factors[kMinCup]);
  Interpolate(parameters.firmness, 3, &factors[kMinFirmness]);
  return factors;
}

ShapeParameters RandomShape(Random& random, int local_pairs) {
  // Extremes are rare in the cube's interior but are what a user's stylised character looks like: some of
  // the values sit at an end.
  const auto uniform_or_extreme = [&random] {
    return random.Chance(0.7) ? random.Uniform() : static_cast<double>(random.Below(2));
  };
  ShapeParameters shape;
  shape.gender = uniform_or_extreme();
  shape.age = random.Chance(0.3) ? random.Uniform(0.0, 0.4) : random.Uniform(0.4, 1.0);
  shape.muscle = uniform_or_extreme();
  shape.weight = uniform_or_extreme();
  shape.height = random.Uniform(0.1, 0.9);
  shape.proportions = random.Uniform();
  shape.cup = random.Uniform();
  shape.firmness = random.Uniform();

  double sum = 0;  // Dirichlet(0.6, 0.6, 0.6): mostly one group, often a mix
  for (double& part : shape.ethnicity) sum += part = SampleGamma(random, 0.6) + 1e-9;
  for (double& part : shape.ethnicity) part /= sum;

  std::vector<int> pairs(local_pairs);
  std::iota(pairs.begin(), pairs.end(), 0);
  const int count = static_cast<int>(std::min<int64_t>(random.Below(25), local_pairs));
  for (int i = 0; i < count; ++i) {  // the first steps of a Fisher-Yates shuffle
    std::swap(pairs[i], pairs[i + random.Below(local_pairs - i)]);
    shape.locals.push_back({pairs[i], std::clamp(random.Normal(0.0, 0.4), -0.9, 0.9)});
  }
  return shape;
}

}  // namespace stance

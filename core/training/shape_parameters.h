// The parameters that make a body: MakeHuman's macro factors and its local morphs.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/random.h"

namespace stance {

// The factors that MakeHuman's macro morphs are products of. Each group's factors sum to 1.
enum ShapeFactor : uint8_t {
  kMale,
  kFemale,
  kAfrican,
  kAsian,
  kCaucasian,
  kChild,
  kYoung,
  kOld,
  kMinMuscle,
  kAverageMuscle,
  kMaxMuscle,
  kMinWeight,
  kAverageWeight,
  kMaxWeight,
  kMinHeight,
  kMaxHeight,
  kIdealProportions,
  kUncommonProportions,
  kMinCup,
  kAverageCup,
  kMaxCup,
  kMinFirmness,
  kAverageFirmness,
  kMaxFirmness,
  kShapeFactorCount,
};

// One identity. All numbers but the local ones lie in [0, 1].
struct ShapeParameters {
  double gender = 0.5;  // 0 female, 1 male
  double age = 0.5;     // 0 child (about ten years), 0.5 young adult, 1 old
  double muscle = 0.5;
  double weight = 0.5;
  double height = 0.5;       // 0 smallest, 1 tallest for the rest of the parameters
  double proportions = 0.5;  // 0 ideal, 1 uncommon
  double cup = 0.5;
  double firmness = 0.5;
  std::array<double, 3> ethnicity = {1.0 / 3, 1.0 / 3, 1.0 / 3};  // African, Asian, Caucasian; sum 1

  // Amount of local morph pairs in [-1, 1], each pair at most once: its positive morph where positive, its
  // negative morph where negative.
  struct Local {
    int pair = 0;
    double amount = 0;
  };
  std::vector<Local> locals;
};

// The factors' values, each group interpolated linearly between its neighbouring members.
std::array<double, kShapeFactorCount> ShapeFactors(const ShapeParameters& parameters);

// A random identity with up to 24 of the `local_pairs` local morph pairs.
ShapeParameters RandomShape(Random& random, int local_pairs);

}  // namespace stance

// How a method's error grows with what disturbs its input: curves over four disturbances' levels.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "core/training/character_generator.h"
#include "core/training/evaluation.h"
#include "core/transfer/pipeline.h"

namespace stance {

enum class Disturbance {
  kVertices,  // Remeshed
  kNoise,     // WithNoise
  kHoles,     // WithHoles
  kTilt,      // Tilted
};

struct Curve {
  Disturbance disturbance = Disturbance::kVertices;
  std::string name;            // "noise"
  std::string unit;            // of the levels: "% of the stature"
  std::vector<double> levels;  // ascending
  bool logarithmic = false;    // how they are drawn
};

// Vertex counts from 500 to 200,000; noise up to 2 % of the stature; holes up to 30 % of the area; tilts up
// to 180 degrees. Level 0, or the level nearest to the meshes' own vertex count, is the pair as it is.
const std::vector<Curve>& AllCurves();

// `pair` at one of the curve's levels: both its meshes are disturbed, and its truth with them. The same seed
// disturbs a pair in the same way at each level.
TransferPair DisturbedPair(const TransferPair& pair, Disturbance disturbance, double level, uint64_t seed);

struct CurveEvaluationOptions {
  uint64_t seed = 1;
  int pairs = 20;
  std::vector<Curve> curves = AllCurves();
  CharacterOptions characters{.poses = PoseMix::kModerate, .split = Split::kTest};
  TransferOptions transfer = {};
  int threads = 1;  // transfers at a time
};

struct CurveRow {
  std::string curve;
  double level = 0;
  int64_t vertices = 0;  // of the source that was transferred
  EvaluationRow row;     // the method's own; a transfer that failed has its message
};

// A row for each curve, level and pair (EvaluatePairs' own), in that order. `progress`, if set, is called
// with the number of transfers done, from any of the threads, one at a time.
std::vector<CurveRow> EvaluateCurves(const CharacterGenerator& generator, const Pipeline& pipeline,
                                     const CurveEvaluationOptions& options,
                                     const std::function<void(int)>& progress = {});

// Means over the pairs of one level that were transferred; all 0 if none was.
struct CurvePoint {
  double level = 0;
  int pairs = 0;
  int failures = 0;
  double vertices = 0;
  double mean_mm = 0;
  double p95_mm = 0;
  double worst_mm = 0;  // the largest mean of a pair
  double pmd = 0;       // m^2
  double elr = 0;
};

// One per level.
std::vector<CurvePoint> CurvePoints(const Curve& curve, const std::vector<CurveRow>& rows);

// One table, a line per curve and level.
std::string CurvesMarkdown(const std::vector<Curve>& curves, const std::vector<CurveRow>& rows);

// One line per row after a header.
std::string CurvesCsv(const std::vector<CurveRow>& rows);

}  // namespace stance

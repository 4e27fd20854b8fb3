// The parametric body as data: what a reader of MPFB's files makes and a character pack stores.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/status.h"
#include "core/base/types.h"

namespace stance {

// Morphs are kept in 16 bits, in steps of a tenth of a millimetre: the resolution of MPFB's own files.
inline constexpr float kMorphUnit = 1e-4f;  // metres

// Most rows of BodyData::points: morphs name them in 16 bits.
inline constexpr int64_t kMaxBodyPoints = 65536;

// Moves some of the body's points.
struct MorphTarget {
  std::vector<uint8_t> factors;  // a macro morph's ShapeFactors (its coefficient is their product)
  std::vector<uint16_t> points;  // rows of BodyData::points, ascending
  std::vector<int16_t> deltas;   // (points, 3) row-major, in kMorphUnit
};

// A triangulation of some of the body's vertices.
struct BodyTopology {
  std::vector<int32_t> vertices;  // ascending rows of BodyData::points, all below vertex_count
  Faces faces;                    // rows of `vertices`
};

struct BodyData {
  int vertex_count = 0;

  // (vertex_count + 24 + E, 3) metres, y up, facing +z, arms as MakeHuman has them: the body's vertices, the
  // canonical joints, and E points among which the lowest and the highest of every identity are found (they
  // give the ground and the stature, the same at every resolution).
  Points points;
  RowMatrix weights;  // (vertex_count, 24), rows sum to 1

  // First `macro_count` macro morphs, then local ones in pairs: positive, negative, positive, ...
  std::vector<MorphTarget> morphs;
  int macro_count = 0;

  std::vector<BodyTopology> levels;  // the first is the whole body, then ever fewer vertices
};

// INVALID_ARGUMENT, naming the first inconsistent field, unless every index and size fits the others.
absl::Status CheckBodyData(const BodyData& body);

}  // namespace stance

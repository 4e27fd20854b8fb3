// The parametric body, ready to make identities in their rest (T) pose at several resolutions.
#pragma once

#include <memory>
#include <vector>

#include "core/base/types.h"
#include "core/skeleton/kinematics.h"
#include "core/training/body_data.h"
#include "core/training/shape_parameters.h"

namespace stance {

// An identity at rest: metres, y up, facing +z, left arm along +x, feet on y = 0.
struct RestBody {
  Points positions;  // (V, 3) of one level
  Points joints;     // (24, 3)
  double stature = 0;
};

// Immutable, so thread-safe. Holds the morphs decoded for every level: some 300 MB for MPFB's body.
class BodyModel {
 public:
  // REQUIRES: CheckBodyData(data) is OK.
  explicit BodyModel(std::shared_ptr<const BodyData> data);

  int level_count() const { return static_cast<int>(levels_.size()); }
  int local_pairs() const { return static_cast<int>(data_->morphs.size() - data_->macro_count) / 2; }
  const BodyData& data() const { return *data_; }

  // The level whose vertex count is nearest to `vertices`; 0 means the whole body.
  int NearestLevel(int vertices) const;

  const Faces& faces(int level) const { return data_->levels[level].faces; }
  const RowMatrix& weights(int level) const { return levels_[level].weights; }
  // (V, 3): the neutral body at rest, centred on its bounding box, divided by its stature.
  const Points& canonical(int level) const { return levels_[level].canonical; }

  // The identity with these parameters. Costs its non-zero morphs times the level's vertices.
  RestBody Shape(const ShapeParameters& parameters, int level) const;

 private:
  struct Morph {
    std::vector<int32_t> rows;  // of Level::points
    std::vector<float> deltas;  // (rows, 3) metres
  };
  struct Level {
    Points points;  // (V + 24 + E, 3) as in BodyData, for the level's vertices
    RowMatrix weights;
    Points canonical;
    std::vector<Morph> morphs;
  };

  Points MorphedPoints(const ShapeParameters& parameters, const Level& level) const;

  std::shared_ptr<const BodyData> data_;
  std::vector<Level> levels_;
  std::vector<Rotation> straighten_;  // (24) global rotations from MakeHuman's pose to the T pose
};

}  // namespace stance

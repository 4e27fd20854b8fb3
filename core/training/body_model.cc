#include "core/training/body_model.h"

#include <cmath>
#include <cstdlib>
#include <utility>

#include "core/base/check.h"
#include "core/training/skinning.h"

namespace stance {
namespace {

// Morphs whose coefficient is below this move nothing that could be seen.
constexpr double kSmallestCoefficient = 1e-4;

// The global rotations that lay both arms along the x axis: MakeHuman stands with its arms lowered and its
// elbows bent. One set for all identities, so that "the same rotation" means the same for each of them.
std::vector<Rotation> StraightenArms(const Points& joints) {
  std::vector<Rotation> rotations(kHumanJoints, Rotation::Identity());
  for (const int joint : {kLeftShoulder, kRightShoulder, kLeftElbow, kRightElbow, kLeftWrist, kRightWrist}) {
    const int child = HumanSkeleton().children(joint)[0];
    const Eigen::Vector3f bone = (joints.row(child) - joints.row(joint)).transpose();
    rotations[joint] = SmallestRotation(bone, Eigen::Vector3f(bone.x() > 0 ? 1 : -1, 0, 0));
  }
  rotations[kLeftHand] = rotations[kLeftWrist];
  rotations[kRightHand] = rotations[kRightWrist];
  return rotations;
}

}  // namespace

BodyModel::BodyModel(std::shared_ptr<const BodyData> data) : data_(std::move(data)) {
  const Eigen::Index extra = data_->points.rows() - data_->vertex_count;
  for (const BodyTopology& topology : data_->levels) {
    const auto count = static_cast<Eigen::Index>(topology.vertices.size());
    Level& level = levels_.emplace_back();
    level.points.resize(count + extra, 3);
    level.weights.resize(count, kHumanJoints);
    std::vector<int32_t> row_of_point(data_->points.rows(), -1);
    for (Eigen::Index i = 0; i < count + extra; ++i) {
      const auto point =
          i < count ? topology.vertices[i] : static_cast<int32_t>(data_->vertex_count + i - count);
      row_of_point[point] = static_cast<int32_t>(i);
      level.points.row(i) = data_->points.row(point);
      if (i < count) level.weights.row(i) = data_->weights.row(point);
    }
    for (const MorphTarget& target : data_->morphs) {
      Morph& morph = level.morphs.emplace_back();
      for (size_t i = 0; i < target.points.size(); ++i) {
        const int32_t row = row_of_point[target.points[i]];
        if (row < 0) continue;
        morph.rows.push_back(row);
        for (int c = 0; c < 3; ++c) morph.deltas.push_back(kMorphUnit * target.deltas[3 * i + c]);
      }
    }
  }

  const Points neutral = MorphedPoints({}, levels_[0]);
  straighten_ = StraightenArms(neutral.middleRows(data_->vertex_count, kHumanJoints));
  const RestBody rest = Shape({}, 0);
  const Eigen::RowVector3f centre =
      0.5f * (rest.positions.colwise().minCoeff() + rest.positions.colwise().maxCoeff());
  for (int i = 0; i < level_count(); ++i) {
    const std::vector<int32_t>& vertices = data_->levels[i].vertices;
    levels_[i].canonical.resize(static_cast<Eigen::Index>(vertices.size()), 3);
    for (size_t v = 0; v < vertices.size(); ++v) {
      levels_[i].canonical.row(static_cast<Eigen::Index>(v)) =
          (rest.positions.row(vertices[v]) - centre) / static_cast<float>(rest.stature);
    }
  }
}

int BodyModel::NearestLevel(int vertices) const {
  STANCE_CHECK(vertices >= 0);
  if (vertices == 0) return 0;
  int nearest = 0;
  for (int i = 1; i < level_count(); ++i) {
    const auto distance = [&](int level) {
      return std::abs(static_cast<int>(data_->levels[level].vertices.size()) - vertices);
    };
    if (distance(i) < distance(nearest)) nearest = i;
  }
  return nearest;
}

Points BodyModel::MorphedPoints(const ShapeParameters& parameters, const Level& level) const {
  Points points = level.points;
  const auto add = [&points](const Morph& morph, double coefficient) {
    const auto c = static_cast<float>(coefficient);
    float* const to = points.data();
    const float* delta = morph.deltas.data();
    for (const int32_t row : morph.rows) {
      float* const p = to + 3 * static_cast<ptrdiff_t>(row);
      p[0] += c * delta[0];
      p[1] += c * delta[1];
      p[2] += c * delta[2];
      delta += 3;
    }
  };
  const auto factors = ShapeFactors(parameters);
  for (int i = 0; i < data_->macro_count; ++i) {
    double coefficient = 1;
    for (const uint8_t factor : data_->morphs[i].factors) coefficient *= factors[factor];
    if (coefficient >= kSmallestCoefficient) add(level.morphs[i], coefficient);
  }
  for (const ShapeParameters::Local& local : parameters.locals) {
    STANCE_CHECK(local.pair >= 0 && local.pair < local_pairs());
    const int morph = data_->macro_count + 2 * local.pair + (local.amount < 0 ? 1 : 0);
    add(level.morphs[morph], std::abs(local.amount));
  }
  return points;
}

RestBody BodyModel::Shape(const ShapeParameters& parameters, int index) const {
  const Level& level = levels_[index];
  const Points points = MorphedPoints(parameters, level);
  const Eigen::Index vertices = level.weights.rows();
  const Points joints = points.middleRows(vertices, kHumanJoints);
  const std::vector<AffineTransform> transforms = PoseTransforms(HumanSkeleton(), joints, straighten_);

  RestBody body;
  body.positions = SkinPoints(points.topRows(vertices), level.weights, transforms);
  body.joints = TransformJoints(joints, transforms);
  // Soles and crown hang on bones that StraightenArms leaves where they are.
  const auto extremes = points.bottomRows(points.rows() - vertices - kHumanJoints).col(1);
  const float ground = extremes.minCoeff();
  body.stature = extremes.maxCoeff() - ground;
  body.positions.col(1).array() -= ground;
  body.joints.col(1).array() -= ground;
  return body;
}

}  // namespace stance

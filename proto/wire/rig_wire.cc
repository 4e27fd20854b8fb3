#include "proto/wire/rig_wire.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cstring>
#include <limits>

#include "core/base/check.h"

namespace stance {
namespace {

static_assert(std::endian::native == std::endian::little);

template <typename T>
void ToBytes(const std::vector<T>& values, std::string* bytes) {
  bytes->assign(reinterpret_cast<const char*>(values.data()), values.size() * sizeof(T));
}

template <typename T>
absl::StatusOr<std::vector<T>> FromBytes(const std::string& bytes, size_t count, const char* field) {
  if (bytes.size() != count * sizeof(T)) {
    return absl::InvalidArgumentError(
        fmt::format("{}: {} bytes, want {}", field, bytes.size(), count * sizeof(T)));
  }
  std::vector<T> values(count);
  if (count > 0) std::memcpy(values.data(), bytes.data(), bytes.size());
  return values;
}

}  // namespace

void SkeletonToWire(const std::vector<std::string>& names, const std::vector<int>& parents,
                    const Points& joints, const Eigen::VectorXf& confidence, v1::Skeleton* wire) {
  STANCE_CHECK(names.size() == parents.size());
  STANCE_CHECK(static_cast<size_t>(joints.rows()) == parents.size());
  STANCE_CHECK(confidence.size() == 0 || confidence.size() == joints.rows());
  wire->mutable_names()->Assign(names.begin(), names.end());
  wire->mutable_parents()->Assign(parents.begin(), parents.end());
  wire->mutable_positions()->Assign(joints.data(), joints.data() + joints.size());
  wire->mutable_confidence()->Assign(confidence.data(), confidence.data() + confidence.size());
}

absl::StatusOr<PlacedSkeleton> SkeletonFromWire(const v1::Skeleton& wire) {
  const int count = wire.parents_size();
  if (wire.names_size() != count) {
    return absl::InvalidArgumentError(fmt::format("names: {} for {} parents", wire.names_size(), count));
  }
  if (wire.positions_size() != 3 * int64_t{count}) {
    return absl::InvalidArgumentError(
        fmt::format("positions: {} numbers for {} joints", wire.positions_size(), count));
  }
  for (int j = 0; j < count; ++j) {
    const int parent = wire.parents(j);
    if (j == 0 ? parent != -1 : parent < 0 || parent >= j) {
      return absl::InvalidArgumentError(fmt::format("parents: joint {} has parent {}", j, parent));
    }
  }
  if (wire.confidence_size() != 0 && wire.confidence_size() != count) {
    return absl::InvalidArgumentError(
        fmt::format("confidence: {} numbers for {} joints", wire.confidence_size(), count));
  }
  for (int j = 0; j < wire.confidence_size(); ++j) {
    if (!(wire.confidence(j) >= 0 && wire.confidence(j) <= 1)) {  // also where it is NaN
      return absl::InvalidArgumentError(
          fmt::format("confidence: joint {} has {}, not in [0, 1]", j, wire.confidence(j)));
    }
  }
  PlacedSkeleton skeleton;
  skeleton.names.assign(wire.names().begin(), wire.names().end());
  skeleton.parents.assign(wire.parents().begin(), wire.parents().end());
  skeleton.joints = Eigen::Map<const Points>(wire.positions().data(), count, 3);
  skeleton.confidence = Eigen::Map<const Eigen::VectorXf>(wire.confidence().data(), wire.confidence_size());
  return skeleton;
}

void WeightsToWire(const RowMatrix& weights, v1::SkinWeights* wire) {
  const Eigen::Index joints = weights.cols();
  std::vector<uint32_t> offsets = {0};
  std::vector<uint16_t> indices;
  std::vector<float> values;
  offsets.reserve(weights.rows() + 1);
  std::vector<uint16_t> order;
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    const float* row = weights.data() + v * joints;
    order.clear();
    for (Eigen::Index j = 0; j < joints; ++j) {
      if (row[j] > 0.0f) order.push_back(static_cast<uint16_t>(j));
    }
    std::stable_sort(order.begin(), order.end(), [row](uint16_t a, uint16_t b) { return row[a] > row[b]; });
    for (const uint16_t j : order) {
      indices.push_back(j);
      values.push_back(row[j]);
    }
    offsets.push_back(static_cast<uint32_t>(values.size()));
  }
  wire->set_vertex_count(static_cast<uint32_t>(weights.rows()));
  wire->set_joint_count(static_cast<uint32_t>(joints));
  ToBytes(offsets, wire->mutable_row_offsets());
  ToBytes(indices, wire->mutable_joint_indices());
  ToBytes(values, wire->mutable_values());
}

absl::StatusOr<RowMatrix> WeightsFromWire(const v1::SkinWeights& wire) {
  const int64_t vertices = wire.vertex_count();
  const int64_t joints = wire.joint_count();
  if (vertices * joints > std::numeric_limits<int32_t>::max()) {
    return absl::InvalidArgumentError(fmt::format("joint_count: {} for {} vertices", joints, vertices));
  }
  STANCE_ASSIGN_OR_RETURN(const std::vector<uint32_t> offsets,
                          FromBytes<uint32_t>(wire.row_offsets(), vertices + 1, "row_offsets"));
  if (offsets.front() != 0 || !std::is_sorted(offsets.begin(), offsets.end())) {
    return absl::InvalidArgumentError("row_offsets: not ascending from 0");
  }
  const size_t entries = offsets.back();
  STANCE_ASSIGN_OR_RETURN(const std::vector<uint16_t> indices,
                          FromBytes<uint16_t>(wire.joint_indices(), entries, "joint_indices"));
  STANCE_ASSIGN_OR_RETURN(const std::vector<float> values,
                          FromBytes<float>(wire.values(), entries, "values"));
  RowMatrix weights = RowMatrix::Zero(vertices, joints);
  for (int64_t v = 0; v < vertices; ++v) {
    for (uint32_t e = offsets[v]; e < offsets[v + 1]; ++e) {
      if (indices[e] >= joints) {
        return absl::InvalidArgumentError(
            fmt::format("joint_indices: vertex {} has joint {} of {}", v, indices[e], joints));
      }
      weights(v, indices[e]) = values[e];
    }
  }
  return weights;
}

void TransformsToWire(std::span<const AffineTransform> transforms,
                      google::protobuf::RepeatedField<float>* wire) {
  wire->Clear();
  wire->Reserve(static_cast<int>(12 * transforms.size()));
  for (const AffineTransform& transform : transforms) {
    for (int row = 0; row < 3; ++row) {
      for (int column = 0; column < 3; ++column) wire->Add(transform.linear(row, column));
      wire->Add(transform.translation(row));
    }
  }
}

absl::StatusOr<std::vector<AffineTransform>> TransformsFromWire(
    const google::protobuf::RepeatedField<float>& wire) {
  if (wire.size() % 12 != 0) {
    return absl::InvalidArgumentError(
        fmt::format("joint_transforms: {} numbers is not a multiple of 12", wire.size()));
  }
  std::vector<AffineTransform> transforms(wire.size() / 12);
  for (size_t j = 0; j < transforms.size(); ++j) {
    for (int row = 0; row < 3; ++row) {
      const float* values = wire.data() + 12 * j + 4 * row;
      for (int column = 0; column < 3; ++column) transforms[j].linear(row, column) = values[column];
      transforms[j].translation(row) = values[3];
    }
  }
  return transforms;
}

void PhasesToWire(const PhaseSeconds& seconds, v1::PhaseTimings* wire) {
  wire->set_check_seconds(seconds.check);
  wire->set_resample_seconds(seconds.resample);
  wire->set_network_seconds(seconds.network);
  wire->set_pose_seconds(seconds.pose);
  wire->set_weights_seconds(seconds.weights);
  wire->set_deform_seconds(seconds.deform);
}

PhaseSeconds PhasesFromWire(const v1::PhaseTimings& wire) {
  return {.check = wire.check_seconds(),
          .resample = wire.resample_seconds(),
          .network = wire.network_seconds(),
          .pose = wire.pose_seconds(),
          .weights = wire.weights_seconds(),
          .deform = wire.deform_seconds(),
          .total = wire.total_seconds()};
}

}  // namespace stance

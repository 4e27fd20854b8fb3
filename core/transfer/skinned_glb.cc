#include "core/transfer/skinned_glb.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <numeric>

#include "core/mesh/io_glb_writer.h"
#include "core/mesh/measure.h"
#include "core/mesh/mesh_check.h"
#include "core/mesh/mesh_io.h"

namespace stance {
namespace {

constexpr int kInfluences = 4;    // of a glTF joint set
constexpr int kMostJoints = 255;  // one byte each

absl::Status CheckRig(const TriangleMesh& mesh, const Skeleton& skeleton, const Rig& rig,
                      const std::vector<std::string>& bone_names) {
  const int joints = skeleton.joint_count();
  if (joints > kMostJoints) {
    return absl::InvalidArgumentError(fmt::format("rig: {} joints; at most {} fit", joints, kMostJoints));
  }
  if (rig.joints.rows() != joints) {
    return absl::InvalidArgumentError(
        fmt::format("rig: {} joint positions for {} joints", rig.joints.rows(), joints));
  }
  if (!bone_names.empty() && std::ssize(bone_names) != joints) {
    return absl::InvalidArgumentError(fmt::format("rig: {} names for {} joints", bone_names.size(), joints));
  }
  if (rig.weights.rows() != mesh.vertex_count() || rig.weights.cols() != joints) {
    return absl::InvalidArgumentError(fmt::format("rig: {} x {} weights for {} vertices and {} joints",
                                                  rig.weights.rows(), rig.weights.cols(), mesh.vertex_count(),
                                                  joints));
  }
  for (int j = 0; j < joints; ++j) {
    if (!rig.joints.row(j).allFinite()) {
      return absl::InvalidArgumentError(fmt::format("rig: joint {} has a non-finite coordinate", j));
    }
  }
  for (int64_t v = 0; v < rig.weights.rows(); ++v) {
    const auto row = rig.weights.row(v);
    if (!row.allFinite() || row.minCoeff() < 0 || row.maxCoeff() <= 0) {
      return absl::InvalidArgumentError(
          fmt::format("rig: the weights of vertex {} are negative, not finite or all zero", v));
    }
  }
  return absl::OkStatus();
}

struct Influences {
  std::vector<uint8_t> joints;  // (V, 4), 0 where the weight is 0
  std::vector<float> weights;   // (V, 4), descending
};

Influences LargestInfluences(const RowMatrix& weights) {
  Influences influences;
  influences.joints.assign(weights.rows() * kInfluences, 0);
  influences.weights.assign(weights.rows() * kInfluences, 0.0f);
  std::vector<int> order(weights.cols());
  const int kept = std::min<int>(kInfluences, static_cast<int>(weights.cols()));
  for (int64_t v = 0; v < weights.rows(); ++v) {
    std::iota(order.begin(), order.end(), 0);
    std::partial_sort(order.begin(), order.begin() + kept, order.end(), [&](int a, int b) {
      return weights(v, a) != weights(v, b) ? weights(v, a) > weights(v, b) : a < b;
    });
    double sum = 0;
    for (int k = 0; k < kept; ++k) sum += weights(v, order[k]);
    for (int k = 0; k < kept; ++k) {
      const float weight = static_cast<float>(weights(v, order[k]) / sum);
      if (weight == 0) break;
      influences.joints[v * kInfluences + k] = static_cast<uint8_t>(order[k]);
      influences.weights[v * kInfluences + k] = weight;
    }
  }
  return influences;
}

// Joint j's inverse bind matrix is T(-joint j), column-major.
std::vector<float> InverseBindMatrices(const Points& joints) {
  std::vector<float> matrices;
  for (int64_t j = 0; j < joints.rows(); ++j) {
    Eigen::Matrix4f matrix = Eigen::Matrix4f::Identity();
    matrix.topRightCorner<3, 1>() = -joints.row(j).transpose();
    matrices.insert(matrices.end(), matrix.data(), matrix.data() + 16);
  }
  return matrices;
}

}  // namespace

absl::StatusOr<std::string> SerializeSkinnedGlb(const TriangleMesh& mesh, const Skeleton& skeleton,
                                                const Rig& rig, const std::vector<std::string>& bone_names) {
  STANCE_RETURN_IF_ERROR(CheckWritable(mesh, MeshFormat::kGlb));
  STANCE_RETURN_IF_ERROR(CheckRig(mesh, skeleton, rig, bone_names));
  const std::vector<std::string>& names = bone_names.empty() ? skeleton.names() : bone_names;

  GlbWriter writer;
  const Influences influences = LargestInfluences(rig.weights);
  const int joint_set = writer.AddBytes(influences.joints);
  const int weight_set = writer.AddFloats(influences.weights, kInfluences, GlbTarget::kVertices);
  TriangleMesh shown = mesh;
  DropBrokenAttributes(shown);
  if (shown.normals.rows() == 0) shown.normals = VertexNormals(mesh.positions, mesh.faces);
  const int mesh_index = writer.AddMesh(shown, {{"JOINTS_0", joint_set}, {"WEIGHTS_0", weight_set}});

  // Joint j becomes node j: the joints are the first nodes.
  std::vector<int> nodes(skeleton.joint_count());
  std::iota(nodes.begin(), nodes.end(), 0);
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    const int parent = skeleton.parents()[j];
    Eigen::Vector3f offset = rig.joints.row(j).transpose();
    if (parent >= 0) offset -= rig.joints.row(parent).transpose();
    writer.AddNode({.name = names[j], .translation = offset, .children = skeleton.children(j)});
  }
  const int matrices = writer.AddFloats(InverseBindMatrices(rig.joints), 16, GlbTarget::kOther);
  const int skin = writer.AddSkin("skeleton", nodes, matrices);
  // At the scene's root: a skinned mesh's own node must not move it.
  const int body = writer.AddNode({.name = "body", .mesh = mesh_index, .skin = skin});
  return writer.Finish({body, nodes[0]});
}

}  // namespace stance

#include "core/training/evaluation_pictures.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/mesh/measure.h"
#include "core/mesh/metrics.h"
#include "core/skeleton/skeleton.h"
#include "core/transfer/up_axis.h"

namespace stance {
namespace {

constexpr std::array<float, 3> kReferenceColor = {0.58f, 0.70f, 0.86f};
constexpr std::array<float, 3> kTargetColor = {0.93f, 0.75f, 0.60f};
constexpr std::array<float, 3> kTruthColor = {0.66f, 0.80f, 0.64f};

// A mesh as the renderer wants it, y up.
struct UprightMesh {
  TriangleMesh mesh;
  Points joints;
};

UprightMesh Upright(const Points& positions, const Faces& faces, const Points& joints, UpAxis up) {
  UprightMesh upright;
  upright.mesh.positions = positions * ToYUp(up).transpose();
  upright.mesh.faces = faces;
  upright.joints = joints * ToYUp(up).transpose();
  return upright;
}

// A reference in centimetres beside a source in metres would fill the picture, or vanish: where the two
// statures differ by more than any two people's, the reference is drawn at the source's.
float ReferenceScale(const TriangleMesh& source, const TriangleMesh& reference) {
  const double ratio = EstimateStature(source.positions, source.faces) /
                       std::max(1e-12, EstimateStature(reference.positions, reference.faces));
  constexpr double kMostBetweenPeople = 4;
  return ratio > kMostBetweenPeople || ratio < 1 / kMostBetweenPeople ? static_cast<float>(ratio) : 1.0f;
}

// Hues a golden angle apart, so that neighbouring joints look different.
Eigen::RowVector3f JointColor(int joint) {
  const double hue = std::fmod(joint * 0.618034, 1.0) * 6;
  const auto channel = [hue](double offset) {
    const double k = std::fmod(offset + hue, 6.0);
    return static_cast<float>(0.95 - 0.6 * std::clamp(std::min(k, 4 - k), 0.0, 1.0));  // HSV, S = 0.63
  };
  return {channel(5), channel(3), channel(1)};
}

Points WeightColors(const RowMatrix& weights) {
  Points palette(weights.cols(), 3);
  for (int j = 0; j < palette.rows(); ++j) palette.row(j) = JointColor(j);
  return weights * palette;
}

// From light grey through orange to dark red at kFullColorErrorMm.
Points ErrorColors(const Eigen::VectorXd& errors_mm) {
  const Eigen::RowVector3f none(0.88f, 0.88f, 0.88f), half(0.98f, 0.62f, 0.22f), full(0.62f, 0.02f, 0.05f);
  Points colors(errors_mm.size(), 3);
  for (Eigen::Index v = 0; v < errors_mm.size(); ++v) {
    const auto t = static_cast<float>(std::clamp(errors_mm[v] / kFullColorErrorMm, 0.0, 1.0) * 2);
    colors.row(v) = t < 1 ? (1 - t) * none + t * half : (2 - t) * half + (t - 1) * full;
  }
  return colors;
}

}  // namespace

Image RenderTransfer(const TriangleMesh& source, const TriangleMesh& reference, const TransferResult& result,
                     const Points* truth, double stature, const PictureOptions& options) {
  const UprightMesh upright_source =
      Upright(source.positions, source.faces, result.source_rig.joints, options.source_up);
  const float scale = ReferenceScale(source, reference);
  const UprightMesh upright_reference = Upright(reference.positions * scale, reference.faces,
                                                result.reference_rig.joints * scale, options.reference_up);
  const UprightMesh upright_target =
      Upright(result.target.positions, source.faces, result.target_joints, options.source_up);
  UprightMesh upright_truth;

  std::vector<RenderItem> items(3);
  items[0] = {.mesh = &upright_source.mesh, .caption = "source"};
  items[1] = {.mesh = &upright_reference.mesh, .color = kReferenceColor, .caption = "reference"};
  items[2] = {.mesh = &upright_target.mesh, .color = kTargetColor, .caption = "target"};
  if (options.skeletons) {
    const std::vector<int>& parents = HumanSkeleton().parents();
    items[0].joints = upright_source.joints;
    items[1].joints = upright_reference.joints;
    items[2].joints = upright_target.joints;
    for (RenderItem& item : items) item.parents = parents;
  }
  if (options.weights) {
    items[0].vertex_colors = items[2].vertex_colors = WeightColors(result.source_rig.weights);
  }
  if (truth != nullptr) {
    upright_truth = Upright(*truth, source.faces, Points(0, 3), options.source_up);
    const Eigen::VectorXd errors =
        VertexErrorsMm(result.target.positions, *truth) * (kReferenceStature / stature);
    items.push_back({.mesh = &upright_truth.mesh, .color = kTruthColor, .caption = "truth"});
    items.push_back({.mesh = &upright_target.mesh,
                     .vertex_colors = ErrorColors(errors),
                     .caption = fmt::format("mean error {:.0f} mm", errors.mean())});
  }
  return RenderTiles(items, options.render);
}

}  // namespace stance

#include "core/mesh/metrics.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/check.h"
#include "core/mesh/nearest_rows.h"

namespace stance {
namespace {

using Edge = std::pair<int32_t, int32_t>;

// Each undirected edge of the faces once.
std::vector<Edge> UndirectedEdges(const Faces& faces) {
  std::vector<Edge> edges;
  edges.reserve(static_cast<size_t>(faces.rows()) * 3);
  for (int64_t f = 0; f < faces.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      const int32_t a = faces(f, corner), b = faces(f, (corner + 1) % 3);
      if (a != b) edges.emplace_back(std::min(a, b), std::max(a, b));
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

double SquaredLength(const Points& points, int32_t a, int32_t b) {
  return (points.row(a).cast<double>() - points.row(b).cast<double>()).squaredNorm();
}

// ELR counts an edge once at each of its ends, hence the factor 2.
double Elr(const Points& predicted, const Points& truth, const std::vector<Edge>& edges) {
  double sum = 0;
  for (const auto& [a, b] : edges) {
    const double true_length = SquaredLength(truth, a, b);
    if (true_length > 0) sum += std::abs(1 - SquaredLength(predicted, a, b) / true_length);
  }
  return 2 * sum / static_cast<double>(truth.rows());
}

double EdgeLengthError(const Points& predicted, const Points& truth, const std::vector<Edge>& edges) {
  if (edges.empty()) return 0;
  double sum = 0;
  for (const auto& [a, b] : edges) {
    const double difference =
        std::sqrt(SquaredLength(predicted, a, b)) - std::sqrt(SquaredLength(truth, a, b));
    sum += difference * difference;
  }
  return sum / static_cast<double>(edges.size());
}

// The mean distance from each point of `from` to its nearest in `to`.
double DirectedChamfer(const Points& from, const Points& to) {
  const std::vector<int32_t> nearest = NearestRow(from, to);
  double sum = 0;
  for (int64_t i = 0; i < from.rows(); ++i) {
    sum += (from.row(i).cast<double>() - to.row(nearest[i]).cast<double>()).norm();
  }
  return sum / static_cast<double>(from.rows());
}

}  // namespace

MeshErrors CompareMeshes(const Points& predicted, const Points& truth, const Faces& faces) {
  STANCE_CHECK(predicted.rows() == truth.rows() && truth.rows() > 0);
  const Eigen::VectorXd distances = VertexErrorsMm(predicted, truth) / 1000;
  const std::vector<Edge> edges = UndirectedEdges(faces);
  MeshErrors errors;
  errors.pmd = distances.squaredNorm() / static_cast<double>(distances.size());
  errors.mean_mm = distances.mean() * 1000;
  errors.max_dist = distances.maxCoeff();
  errors.elr = Elr(predicted, truth, edges);
  errors.el = EdgeLengthError(predicted, truth, edges);
  errors.edge_ratio_error = EdgeRatioError(predicted, truth, faces);
  errors.chamfer = ChamferDistance(predicted, truth);
  const Eigen::RowVector3d shift = (predicted.cast<double>() - truth.cast<double>()).colwise().mean();
  errors.centred_pmd = std::max(0.0, errors.pmd - shift.squaredNorm());
  return errors;
}

Eigen::VectorXd VertexErrorsMm(const Points& predicted, const Points& truth) {
  STANCE_CHECK(predicted.rows() == truth.rows());
  return (predicted.cast<double>() - truth.cast<double>()).rowwise().norm() * 1000;
}

double EdgeLengthError(const Points& predicted, const Points& truth, const Faces& faces) {
  return EdgeLengthError(predicted, truth, UndirectedEdges(faces));
}

double EdgeRatioError(const Points& predicted, const Points& truth, const Faces& faces) {
  double sum = 0;
  for (int64_t f = 0; f < faces.rows(); ++f) {
    for (int corner = 0; corner < 3; ++corner) {
      const int32_t a = faces(f, corner), b = faces(f, (corner + 1) % 3);
      const double true_length = SquaredLength(truth, a, b);
      if (true_length > 0) sum += std::abs(std::sqrt(SquaredLength(predicted, a, b) / true_length) - 1) / 3;
    }
  }
  return faces.rows() == 0 ? 0 : sum / static_cast<double>(faces.rows());
}

double ChamferDistance(const Points& a, const Points& b) {
  STANCE_CHECK(a.rows() > 0 && b.rows() > 0);
  return (DirectedChamfer(a, b) + DirectedChamfer(b, a)) / 2;
}

BoneLengthDeviation CompareBoneLengths(const std::vector<Points>& joints, const std::vector<int>& parents) {
  BoneLengthDeviation result;
  const double poses = static_cast<double>(joints.size());
  int bones = 0;
  for (size_t j = 0; j < parents.size() && !joints.empty(); ++j) {
    if (parents[j] < 0) continue;
    Eigen::VectorXd lengths(static_cast<Eigen::Index>(joints.size()));
    for (size_t p = 0; p < joints.size(); ++p) {
      lengths[static_cast<Eigen::Index>(p)] =
          std::sqrt(SquaredLength(joints[p], static_cast<int32_t>(j), parents[j]));
    }
    const double mean = lengths.mean();
    const double deviation = std::sqrt((lengths.array() - mean).square().sum() / poses);
    result.mean_length += mean;
    result.mean_deviation += deviation;
    result.max_deviation = std::max(result.max_deviation, deviation);
    ++bones;
  }
  if (bones > 0) {
    result.mean_length /= bones;
    result.mean_deviation /= bones;
  }
  return result;
}

}  // namespace stance

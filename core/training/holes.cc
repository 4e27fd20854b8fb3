#include "core/training/holes.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/check.h"
#include "core/mesh/measure.h"

namespace stance {
namespace {

constexpr double kLeastRadius = 0.04, kMostRadius = 0.15;  // metres
constexpr double kLeastArea = 0.7;                         // of the whole mesh's

Eigen::RowVector3f Centroid(const Points& positions, const Faces& faces, Eigen::Index f) {
  return (positions.row(faces(f, 0)) + positions.row(faces(f, 1)) + positions.row(faces(f, 2))) / 3;
}

double FaceArea(const Points& positions, const Faces& faces, Eigen::Index f) {
  return SurfaceArea(positions, faces.middleRows(f, 1));
}

// A face drawn with probability proportional to its area.
Eigen::Index DrawByArea(Random& random, const Points& positions, const Faces& faces) {
  double left = random.Uniform() * SurfaceArea(positions, faces);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    left -= FaceArea(positions, faces, f);
    if (left < 0) return f;
  }
  return faces.rows() - 1;  // rounding
}

Faces Outside(const Eigen::RowVector3f& centre, double radius, const Points& positions, const Faces& faces) {
  std::vector<int32_t> corners;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    if ((Centroid(positions, faces, f) - centre).norm() > radius)
      corners.insert(corners.end(), faces.row(f).begin(), faces.row(f).end());
  }
  return Eigen::Map<const Faces>(corners.data(), static_cast<Eigen::Index>(corners.size() / 3), 3);
}

}  // namespace

Faces CutHoles(Random& random, int balls, const Points& positions, const Faces& faces) {
  const double least = kLeastArea * SurfaceArea(positions, faces);
  Faces kept = faces;
  for (int ball = 0; ball < balls; ++ball) {
    const int32_t centre = kept(random.Below(kept.rows()), random.Below(3));
    const double radius = random.Uniform(kLeastRadius, kMostRadius);
    const Faces outside = Outside(positions.row(centre), radius, positions, kept);
    if (SurfaceArea(positions, outside) >= least) kept = outside;
  }
  return kept;
}

Faces CutShare(Random& random, double share, const Points& positions, const Faces& faces) {
  STANCE_CHECK(share >= 0 && share < 1);
  double surplus = share * SurfaceArea(positions, faces);
  Faces kept = faces;
  while (surplus > 0 && kept.rows() > 0) {
    const Eigen::RowVector3f centre =
        positions.row(kept(DrawByArea(random, positions, kept), random.Below(3)));
    const double radius = random.Uniform(kLeastRadius, kMostRadius);
    std::vector<std::pair<float, Eigen::Index>> order;  // distance from the centre, face
    for (Eigen::Index f = 0; f < kept.rows(); ++f) {
      order.emplace_back((Centroid(positions, kept, f) - centre).norm(), f);
    }
    std::sort(order.begin(), order.end());
    // The first face goes even if it is so large that its centroid is outside: every ball cuts something.
    size_t cut = 0;
    while (surplus > 0 && cut < order.size() && (cut == 0 || order[cut].first <= radius)) {
      surplus -= FaceArea(positions, kept, order[cut++].second);
    }
    Faces outside(kept.rows() - static_cast<Eigen::Index>(cut), 3);
    std::sort(order.begin() + static_cast<std::ptrdiff_t>(cut), order.end(),
              [](const auto& a, const auto& b) { return a.second < b.second; });
    for (Eigen::Index f = 0; f < outside.rows(); ++f) outside.row(f) = kept.row(order[cut + f].second);
    kept = std::move(outside);
  }
  return kept;
}

}  // namespace stance

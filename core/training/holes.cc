#include "core/training/holes.h"

#include <vector>

#include "core/mesh/measure.h"

namespace stance {
namespace {

constexpr double kLeastRadius = 0.04, kMostRadius = 0.15;  // metres
constexpr double kLeastArea = 0.7;                         // of the whole mesh's

Faces Outside(const Eigen::RowVector3f& centre, double radius, const Points& positions, const Faces& faces) {
  std::vector<int32_t> corners;
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Eigen::RowVector3f centroid =
        (positions.row(faces(f, 0)) + positions.row(faces(f, 1)) + positions.row(faces(f, 2))) / 3;
    if ((centroid - centre).norm() > radius)
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

}  // namespace stance

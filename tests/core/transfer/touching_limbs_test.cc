// A hand that lies on a thigh must not stick to it: surface samples, the networks' neighbourhoods and the
// weights follow the surface, however near another part of it comes.

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>

#include "core/mesh/geodesic_neighbors.h"
#include "core/mesh/weld.h"
#include "core/transfer/screened_weights.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

constexpr int kThigh = kLeftHip, kBetween = kLeftElbow, kTouching = kLeftHand;
constexpr int64_t kSamples = 1024;

struct Touching {
  std::string name;
  TriangleMesh mesh;       // of limbs that touch
  std::vector<int> joint;  // (V) which each vertex belongs to
  std::vector<char> firm;  // (V) whether no border between two joints is near along the surface
};

// One body: a tube that comes back to itself all the way of its second turn, `gap` metres off.
Touching Coiled(const std::string& name, float gap) {
  constexpr int kSegments = 24, kSections = 120;
  Touching coil{name, testing::Coil(gap, 0.05f, 0.3f, kSegments, kSections), {}, {}};
  const int64_t rows = coil.mesh.vertex_count();
  for (int64_t v = 0; v < rows; ++v) {
    const int64_t circle = v < rows - 2 ? v / kSegments : v == rows - 2 ? 0 : 2 * kSections;
    coil.joint.push_back(circle < 0.85 * kSections   ? kThigh
                         : circle > 1.15 * kSections ? kTouching
                                                     : kBetween);
    coil.firm.push_back(circle < 0.7 * kSections || circle > 1.3 * kSections);
  }
  return coil;
}

// Two bodies: a limb of `radius` along another of 8 cm, `gap` metres off.
Touching Parallel(const std::string& name, float radius, float gap) {
  const TriangleMesh thigh = testing::Capsule(0.5f, 0.08f, 32, 8, 24);
  const TriangleMesh limb =
      testing::Shifted(testing::Capsule(0.2f, radius, 24, 6, 16), {0.08f + gap + radius, 0, 0});
  Touching parallel{name, testing::Together({thigh, limb}), {}, {}};
  parallel.joint.assign(thigh.vertex_count(), kThigh);
  parallel.joint.resize(parallel.mesh.vertex_count(), kTouching);
  parallel.firm.assign(parallel.joint.size(), 1);
  return parallel;
}

// Every corner a vertex of its own, as STL stores it.
Touching UnweldedCorners(const Touching& from) {
  Touching unwelded{"unwelded_" + from.name, testing::Unwelded(from.mesh), {}, {}};
  for (int64_t i = 0; i < from.mesh.faces.size(); ++i) {
    unwelded.joint.push_back(from.joint[from.mesh.faces.data()[i]]);
    unwelded.firm.push_back(from.firm[from.mesh.faces.data()[i]]);
  }
  return unwelded;
}

std::vector<Touching> Cases() {
  std::vector<Touching> cases = {
      Coiled("coil_1_mm_off", 0.001f),
      Coiled("coil_through_itself_by_5_mm", -0.005f),
      Parallel("limb_1_mm_off", 0.04f, 0.001f),
      Parallel("limb_in_the_other_by_5_mm", 0.04f, -0.005f),
  };
  for (int i = 0; i < 4; ++i) cases.push_back(UnweldedCorners(cases[i]));
  return cases;
}

class TouchingLimbs : public ::testing::TestWithParam<Touching> {
 protected:
  // As the pipeline does: coincident vertices made one first.
  TouchingLimbs() : welded_(WeldVertices(GetParam().mesh)) {
    samples_ = ResampleSurface(welded_.mesh, {kSamples, 12});
    joint_.resize(welded_.mesh.vertex_count());
    for (size_t v = 0; v < GetParam().joint.size(); ++v) {
      joint_[welded_.welded_row[v]] = GetParam().joint[v];
    }
  }

  // The joint of the corner that counts most.
  int JointOf(int64_t sample) const {
    const SurfacePlace& place = samples_.place[sample];
    return joint_[place.corner[std::max_element(place.weight.begin(), place.weight.end()) -
                               place.weight.begin()]];
  }

  WeldedMesh welded_;
  std::vector<int> joint_;  // of the welded vertices
  SurfaceSamples samples_;
};

TEST_P(TouchingLimbs, KeepTheirOwnWeights) {
  auto sampled = std::make_shared<SampledWeights>();
  sampled->weights = RowMatrix::Zero(samples_.points.rows(), kHumanJoints);
  for (int64_t s = 0; s < samples_.points.rows(); ++s) sampled->weights(s, JointOf(s)) = 1;
  sampled->samples = samples_;
  Rig rig;
  rig.sampled = sampled;
  const auto weights = ScreenedSmoother().Smooth(welded_.mesh, rig);
  ASSERT_TRUE(weights.ok()) << weights.status();
  for (size_t v = 0; v < GetParam().joint.size(); ++v) {
    if (!GetParam().firm[v]) continue;
    ASSERT_GT((*weights)(welded_.welded_row[v], GetParam().joint[v]), 0.95f) << "vertex " << v;
  }
}

TEST_P(TouchingLimbs, AreNoNeighbours) {
  const int64_t targets[] = {kSamples, kSamples / 4};
  for (const int64_t count : targets) {
    const NeighborTable near = GeodesicNeighbors(samples_.graph, samples_.points, 0, kSamples, count, 16, 1);
    int64_t across = 0;
    for (int64_t s = 0; s < kSamples; ++s) {
      for (int k = 0; k < 16; ++k) {
        const int from = JointOf(s), to = JointOf(near(s, k));
        across += (from == kThigh && to == kTouching) || (from == kTouching && to == kThigh);
      }
    }
    EXPECT_EQ(across, 0) << count;
  }
}

INSTANTIATE_TEST_SUITE_P(Meshes, TouchingLimbs, ::testing::ValuesIn(Cases()),
                         [](const auto& test) { return test.param.name; });

}  // namespace
}  // namespace stance

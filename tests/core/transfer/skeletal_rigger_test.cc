#include "core/transfer/skeletal_rigger.h"

#include <gtest/gtest.h>

#include "tests/support/meshes.h"
#include "tests/support/untrained_model.h"

namespace stance {
namespace {

class SkeletalRiggerTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const testing::UntrainedModel files(200);
    auto model = SkeletalModel::Load(files.dir());
    ASSERT_TRUE(model.ok()) << model.status();
    model_ = std::move(*model);
  }
  static void TearDownTestSuite() { model_.reset(); }
  static inline std::unique_ptr<SkeletalModel> model_;
};

TEST_F(SkeletalRiggerTest, WeightsAreRigidAtAnyResolution) {
  const TriangleMesh coarse = testing::Box(), fine = testing::Icosphere(5);
  const TriangleMesh* meshes[] = {&coarse, &fine};
  for (const bool full_resolution : {false, true}) {
    PhaseSeconds seconds;
    const auto rigs = SkeletalRigger(*model_, 1, full_resolution).RigMeshes(meshes, seconds);
    ASSERT_TRUE(rigs.ok()) << rigs.status();
    for (int i = 0; i < 2; ++i) {
      const RowMatrix& w = (*rigs)[i].weights;
      ASSERT_EQ(w.rows(), meshes[i]->vertex_count());
      EXPECT_TRUE(((w.array() == 0) || (w.array() == 1)).all());
      EXPECT_EQ(w.rowwise().sum(), Eigen::VectorXf::Ones(w.rows()));
      EXPECT_TRUE((*rigs)[i].joints.allFinite());
    }
  }
}

TEST_F(SkeletalRiggerTest, ShufflingTheVerticesShufflesTheRig) {
  TriangleMesh mesh = testing::Capsule(1.2f, 0.2f, 24, 6, 20);
  mesh.positions.col(0) +=
      0.2f * mesh.positions.col(1).cwiseAbs2() + 0.1f * mesh.positions.col(2);  // no symmetry
  mesh.positions.col(2) += 0.13f * mesh.positions.col(1) + 0.05f * mesh.positions.col(0).cwiseAbs2();
  std::vector<int32_t> order;
  const TriangleMesh shuffled = testing::Shuffled(mesh, 3, &order);
  const TriangleMesh* meshes[] = {&mesh, &shuffled};
  PhaseSeconds seconds;
  const auto rigs = SkeletalRigger(*model_, 1, false).RigMeshes(meshes, seconds);
  ASSERT_TRUE(rigs.ok());
  EXPECT_LT(((*rigs)[0].joints - (*rigs)[1].joints).cwiseAbs().maxCoeff(), 1e-3f);
  int64_t different = 0;
  for (int64_t v = 0; v < mesh.vertex_count(); ++v) {
    different += (*rigs)[0].weights.row(v) != (*rigs)[1].weights.row(order[v]);
  }
  EXPECT_LE(different, mesh.vertex_count() / 100);  // vertices equally far from two samples
}

}  // namespace
}  // namespace stance

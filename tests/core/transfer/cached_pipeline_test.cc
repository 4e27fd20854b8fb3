// What a pipeline makes of rigs that it has kept.

#include <gtest/gtest.h>

#include <limits>
#include <memory>
#include <thread>
#include <vector>

#include "core/transfer/pipeline.h"
#include "core/transfer/rig_cache.h"
#include "tests/support/meshes.h"
#include "tests/support/untrained_model.h"

namespace stance {
namespace {

class CachedPipelineTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    skeletal_ = std::make_unique<testing::UntrainedModel>(256);
    learned_ = std::make_unique<testing::UntrainedModel>(256, 2, "stance");
  }
  static void TearDownTestSuite() {
    skeletal_.reset();
    learned_.reset();
  }
  static std::unique_ptr<Pipeline> Load(std::shared_ptr<RigCache> cache) {
    auto pipeline = Pipeline::Load({skeletal_->dir(), learned_->dir()}, {.threads = 2, .rig_cache = cache});
    EXPECT_TRUE(pipeline.ok()) << pipeline.status();
    return *std::move(pipeline);
  }

  static inline std::unique_ptr<testing::UntrainedModel> skeletal_, learned_;
  const std::shared_ptr<RigCache> cache_ = std::make_shared<RigCache>(int64_t{256} << 20);
  const std::unique_ptr<Pipeline> pipeline_ = Load(cache_);
  const TriangleMesh source_ = testing::Capsule(1.2f, 0.2f, 24, 6, 20);
  const TriangleMesh reference_ = testing::Icosphere(3);
};

void ExpectSame(const TransferResult& a, const TransferResult& b) {
  EXPECT_EQ(a.target.positions, b.target.positions);
  EXPECT_EQ(a.source_rig.weights, b.source_rig.weights);
  EXPECT_EQ(a.source_rig.joints, b.source_rig.joints);
  EXPECT_EQ(a.reference_rig.joints, b.reference_rig.joints);
  EXPECT_EQ(a.target_joints, b.target_joints);
  EXPECT_EQ(a.confidence, b.confidence);
  EXPECT_EQ(a.warnings, b.warnings);
}

TEST_F(CachedPipelineTest, AnswersAreTheSameBitForBit) {
  const std::unique_ptr<Pipeline> uncached = Load(nullptr);
  for (const Method method : {Method::kSkeletal, Method::kStance}) {
    SCOPED_TRACE(MethodName(method));
    const TransferOptions options{.method = method};
    const RigCache::Stats before = cache_->stats();
    const auto cold = pipeline_->Transfer(source_, reference_, options);
    const auto warm = pipeline_->Transfer(source_, reference_, options);
    const auto plain = uncached->Transfer(source_, reference_, options);
    ASSERT_TRUE(cold.ok() && warm.ok() && plain.ok());
    ExpectSame(*cold, *plain);
    ExpectSame(*warm, *plain);
    EXPECT_EQ(cache_->stats().misses, before.misses + 2);
    EXPECT_EQ(cache_->stats().hits, before.hits + 2);
    EXPECT_GT(cold->seconds.network, 0);
    EXPECT_EQ(warm->seconds.network, 0);
    EXPECT_EQ(warm->seconds.resample, 0);
  }
}

TEST_F(CachedPipelineTest, ARigServesTransfersAndTheOtherWayRound) {
  ASSERT_TRUE(pipeline_->RigMesh(source_).ok());
  const auto transfer = pipeline_->Transfer(reference_, source_);
  ASSERT_TRUE(transfer.ok());
  EXPECT_EQ(cache_->stats().hits, 1);
  EXPECT_EQ(cache_->stats().misses, 2);
  ASSERT_TRUE(pipeline_->RigMesh(reference_).ok());
  EXPECT_EQ(cache_->stats().hits, 2);
}

TEST_F(CachedPipelineTest, FramesAttributesAndInfluencesAreNoPartOfTheRig) {
  const auto four = pipeline_->RigMesh(source_);
  TriangleMesh z_up = testing::WithAttributes(source_);
  z_up.positions.col(1) = -source_.positions.col(2);
  z_up.positions.col(2) = source_.positions.col(1);
  const auto one = pipeline_->RigMesh(z_up, {.source_up = UpAxis::kZ, .max_influences = 1});
  ASSERT_TRUE(four.ok() && one.ok());
  EXPECT_EQ(cache_->stats().hits, 1);
  EXPECT_LE((one->rig.weights.array() > 0).rowwise().count().maxCoeff(), 1);
  EXPECT_EQ(one->rig.joints.col(2), four->rig.joints.col(1));
}

TEST_F(CachedPipelineTest, SmoothWeightsAreThoseOfTheirOptions) {
  const std::unique_ptr<Pipeline> uncached = Load(nullptr);
  for (const double length : {0.024, 0.1, 0.024}) {
    const TransferOptions options{.method = Method::kSkeletal, .smoothing = {.length = length}};
    const auto cached = pipeline_->RigMesh(source_, options), plain = uncached->RigMesh(source_, options);
    ASSERT_TRUE(cached.ok() && plain.ok());
    EXPECT_EQ(cached->rig.weights, plain->rig.weights);
  }
}

TEST_F(CachedPipelineTest, EqualMeshesOfABatchAreRiggedOnce) {
  const TriangleMesh same = source_;
  const TransferJob jobs[] = {{&source_, &reference_, {}}, {&same, &reference_, {}}, {&source_, &same, {}}};
  const auto results = pipeline_->TransferBatch(jobs);
  for (const auto& result : results) ASSERT_TRUE(result.ok()) << result.status();
  EXPECT_EQ(cache_->stats().entries, 2);
  EXPECT_EQ(cache_->stats().misses, 2);
  EXPECT_EQ(results[0]->target.positions, results[1]->target.positions);
  // Only one of them paid for it.
  EXPECT_GT(results[0]->seconds.network, 0);
  EXPECT_EQ(results[1]->seconds.network, 0);
}

TEST_F(CachedPipelineTest, BadMeshesAreNotKept) {
  TriangleMesh bad = source_;
  bad.positions(7, 1) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_FALSE(pipeline_->RigMesh(bad).ok());
  EXPECT_EQ(cache_->stats().entries, 0);
}

TEST_F(CachedPipelineTest, WarmingUpGoesPastTheCache) {
  ASSERT_TRUE(pipeline_->WarmUp().ok());
  EXPECT_EQ(cache_->stats().misses, 0);
  EXPECT_EQ(cache_->stats().entries, 0);
}

TEST_F(CachedPipelineTest, AnotherModelHasItsOwnRigsAndTakesThemAlong) {
  {
    const std::unique_ptr<Pipeline> other = Load(cache_);
    ASSERT_TRUE(pipeline_->RigMesh(source_).ok());
    ASSERT_TRUE(other->RigMesh(source_).ok());
    EXPECT_EQ(cache_->stats().misses, 2);
    EXPECT_EQ(cache_->stats().entries, 2);
  }
  EXPECT_EQ(cache_->stats().entries, 1);
}

TEST_F(CachedPipelineTest, ThreadsShareIt) {
  const auto expected = pipeline_->RigMesh(source_);
  ASSERT_TRUE(expected.ok());
  std::vector<std::thread> threads;
  for (int t = 0; t < 3; ++t) {
    threads.emplace_back([&] {
      for (int i = 0; i < 3; ++i) {
        const auto rig = pipeline_->RigMesh(source_);
        ASSERT_TRUE(rig.ok());
        EXPECT_EQ(rig->rig.weights, expected->rig.weights);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(cache_->stats().hits, 9);
}

TEST_F(CachedPipelineTest, ASourceRiggedBeforeServesManyReferences) {
  const std::unique_ptr<Pipeline> uncached = Load(nullptr);
  const TransferOptions options{.reference_up = UpAxis::kZ, .facing = Facing::kSource};
  const RigJob source{&source_, options};
  const auto rigged = std::move(uncached->RigSources({&source, 1})[0]);
  ASSERT_TRUE(rigged.ok()) << rigged.status();
  EXPECT_GT(rigged->seconds.network, 0);
  const TriangleMesh box = testing::Box();
  for (const TriangleMesh* reference : {&reference_, &box}) {
    TransferJob job{&source_, reference, options};
    const auto whole = std::move(uncached->TransferBatch({&job, 1})[0]);
    job.rigged = rigged->rigged;
    const auto half = std::move(uncached->TransferBatch({&job, 1})[0]);
    ASSERT_TRUE(whole.ok() && half.ok());
    EXPECT_LT((whole->target.positions - half->target.positions).cwiseAbs().maxCoeff(), 2e-3f);
    EXPECT_EQ(whole->warnings, half->warnings);
  }
  // Another pipeline, as after a reload, rigs it itself.
  const TransferJob job{&source_, &reference_, options, {}, rigged->rigged};
  const auto elsewhere = std::move(pipeline_->TransferBatch({&job, 1})[0]);
  ASSERT_TRUE(elsewhere.ok());
  EXPECT_EQ(cache_->stats().misses, 2);
}

TEST_F(CachedPipelineTest, ABadSourceIsNamed) {
  const TriangleMesh bad;
  const RigJob jobs[] = {{&bad, {}}, {&source_, {}}};
  const auto results = pipeline_->RigSources(jobs);
  EXPECT_EQ(results[0].status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_TRUE(std::string(results[0].status().message()).starts_with("source: ")) << results[0].status();
  EXPECT_TRUE(results[1].ok());
}

}  // namespace
}  // namespace stance

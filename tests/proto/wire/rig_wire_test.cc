#include "proto/wire/rig_wire.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <string>

#include "core/base/random.h"

namespace stance {
namespace {

using ::testing::StartsWith;

template <typename T>
void ExpectInvalid(const absl::StatusOr<T>& result, const std::string& start) {
  EXPECT_EQ(result.status().code(), absl::StatusCode::kInvalidArgument);
  EXPECT_THAT(std::string(result.status().message()), StartsWith(start));
}

// Four positive entries in each row of (V, 24), every fifth row one-hot.
RowMatrix RandomWeights(int vertices, uint64_t seed) {
  Random random(seed);
  RowMatrix weights = RowMatrix::Zero(vertices, 24);
  for (int v = 0; v < vertices; ++v) {
    const int count = v % 5 == 0 ? 1 : 4;
    for (int k = 0; k < count; ++k)
      weights(v, random.Below(24)) += static_cast<float>(random.Uniform(0.1, 1.0));
    weights.row(v) /= weights.row(v).sum();
  }
  return weights;
}

TEST(RigWireTest, WeightsRoundTripExactly) {
  const RowMatrix weights = RandomWeights(200, 1);
  v1::SkinWeights wire;
  WeightsToWire(weights, &wire);
  const absl::StatusOr<RowMatrix> read = WeightsFromWire(wire);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(*read, weights);
}

TEST(RigWireTest, WeightsDescendWithinAVertex) {
  const RowMatrix weights = RandomWeights(200, 2);
  v1::SkinWeights wire;
  WeightsToWire(weights, &wire);
  std::vector<uint32_t> offsets(201);
  std::memcpy(offsets.data(), wire.row_offsets().data(), wire.row_offsets().size());
  std::vector<float> values(offsets.back());
  std::memcpy(values.data(), wire.values().data(), wire.values().size());
  for (int v = 0; v < 200; ++v) {
    for (uint32_t e = offsets[v]; e + 1 < offsets[v + 1]; ++e) EXPECT_GE(values[e], values[e + 1]) << v;
  }
}

TEST(RigWireTest, DamagedWeightsAreRefusedWithTheirField) {
  v1::SkinWeights good;
  WeightsToWire(RandomWeights(10, 3), &good);
  v1::SkinWeights bad = good;
  bad.mutable_row_offsets()->pop_back();
  ExpectInvalid(WeightsFromWire(bad), "row_offsets: 43 bytes, want 44");
  bad = good;
  (*bad.mutable_row_offsets())[0] = 1;
  ExpectInvalid(WeightsFromWire(bad), "row_offsets: not ascending from 0");
  bad = good;
  bad.mutable_row_offsets()->replace(8, 4, "\0\0\0\0", 4);
  ExpectInvalid(WeightsFromWire(bad), "row_offsets: not ascending from 0");
  bad = good;
  bad.mutable_joint_indices()->append("xx");
  ExpectInvalid(WeightsFromWire(bad), "joint_indices: ");
  bad = good;
  bad.mutable_joint_indices()->replace(0, 2, "\x18\0", 2);
  ExpectInvalid(WeightsFromWire(bad), "joint_indices: vertex 0 has joint 24 of 24");
  bad = good;
  bad.mutable_values()->clear();
  ExpectInvalid(WeightsFromWire(bad), "values: 0 bytes");
  bad = good;
  bad.set_vertex_count(4000000000u);
  ExpectInvalid(WeightsFromWire(bad), "joint_count: 24 for 4000000000 vertices");
}

TEST(RigWireTest, SkeletonRoundTrips) {
  Points joints(3, 3);
  joints << 0, 1, 2, 3, 4, 5, 6, 7, 8;
  v1::Skeleton wire;
  const Eigen::VectorXf confidence{{0.0f, 0.25f, 1.0f}};
  SkeletonToWire({"a", "b", "c"}, {-1, 0, 0}, joints, confidence, &wire);
  const absl::StatusOr<PlacedSkeleton> read = SkeletonFromWire(wire);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_THAT(read->names, ::testing::ElementsAre("a", "b", "c"));
  EXPECT_THAT(read->parents, ::testing::ElementsAre(-1, 0, 0));
  EXPECT_EQ(read->joints, joints);
  EXPECT_EQ(read->confidence, confidence);
  SkeletonToWire({"a", "b", "c"}, {-1, 0, 0}, joints, {}, &wire);
  EXPECT_EQ(wire.confidence_size(), 0);
  EXPECT_EQ(SkeletonFromWire(wire)->confidence.size(), 0);
}

TEST(RigWireTest, DamagedSkeletonsAreRefusedWithTheirField) {
  v1::Skeleton good;
  SkeletonToWire({"a", "b"}, {-1, 0}, Points::Zero(2, 3), Eigen::VectorXf{{0.5f, 0.75f}}, &good);
  v1::Skeleton bad = good;
  bad.mutable_names()->RemoveLast();
  ExpectInvalid(SkeletonFromWire(bad), "names: 1 for 2 parents");
  bad = good;
  bad.add_positions(0);
  ExpectInvalid(SkeletonFromWire(bad), "positions: 7 numbers for 2 joints");
  bad = good;
  bad.set_parents(1, 1);
  ExpectInvalid(SkeletonFromWire(bad), "parents: joint 1 has parent 1");
  bad = good;
  bad.set_parents(0, 0);
  ExpectInvalid(SkeletonFromWire(bad), "parents: joint 0 has parent 0");
  bad = good;
  bad.mutable_confidence()->RemoveLast();
  ExpectInvalid(SkeletonFromWire(bad), "confidence: 1 numbers for 2 joints");
  bad = good;
  bad.set_confidence(1, 1.5f);
  ExpectInvalid(SkeletonFromWire(bad), "confidence: joint 1 has 1.5");
  bad.set_confidence(1, std::nanf(""));
  ExpectInvalid(SkeletonFromWire(bad), "confidence: joint 1 has nan");
}

TEST(RigWireTest, TransformsRoundTripRowMajor) {
  std::vector<AffineTransform> transforms(2);
  transforms[1].linear << 1, 2, 3, 5, 6, 7, 9, 10, 11;
  transforms[1].translation << 4, 8, 12;
  v1::TransferResponse wire;
  TransformsToWire(transforms, wire.mutable_joint_transforms());
  ASSERT_EQ(wire.joint_transforms_size(), 24);
  for (int i = 0; i < 12; ++i) EXPECT_EQ(wire.joint_transforms(12 + i), i + 1);
  const auto read = TransformsFromWire(wire.joint_transforms());
  ASSERT_TRUE(read.ok());
  ASSERT_EQ(read->size(), 2u);
  EXPECT_EQ((*read)[1].linear, transforms[1].linear);
  EXPECT_EQ((*read)[1].translation, transforms[1].translation);
  wire.add_joint_transforms(0);
  ExpectInvalid(TransformsFromWire(wire.joint_transforms()), "joint_transforms: 25 numbers");
}

TEST(RigWireTest, PhasesRoundTrip) {
  v1::PhaseTimings wire;
  wire.set_queue_seconds(9);
  PhasesToWire({.check = 1, .resample = 2, .network = 3, .pose = 4, .weights = 5, .deform = 6, .total = 99},
               &wire);
  EXPECT_EQ(wire.queue_seconds(), 9);
  EXPECT_EQ(wire.total_seconds(), 0);
  wire.set_total_seconds(7);
  const PhaseSeconds read = PhasesFromWire(wire);
  EXPECT_EQ(read.check, 1);
  EXPECT_EQ(read.resample, 2);
  EXPECT_EQ(read.network, 3);
  EXPECT_EQ(read.pose, 4);
  EXPECT_EQ(read.weights, 5);
  EXPECT_EQ(read.deform, 6);
  EXPECT_EQ(read.total, 7);
}

}  // namespace
}  // namespace stance

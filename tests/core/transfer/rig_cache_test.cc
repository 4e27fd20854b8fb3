#include "core/transfer/rig_cache.h"

#include <gtest/gtest.h>

#include <cmath>
#include <thread>
#include <utility>
#include <vector>

#include "tests/support/meshes.h"

namespace stance {
namespace {

constexpr int64_t kRoomy = int64_t{1} << 30;

// A rig that can be told from others.
CachedRig Tagged(float tag, int64_t vertices) {
  Rig rig;
  rig.joints = Points::Constant(24, 3, tag);
  rig.weights = RowMatrix::Constant(vertices, 24, tag);
  return {std::make_shared<const Rig>(std::move(rig))};
}

float TagOf(const CachedRig& cached) { return cached.rig->joints(0, 0); }

TEST(RigCacheTest, FindsBySurfaceAndRigger) {
  RigCache cache(kRoomy);
  const TriangleMesh sphere = testing::Icosphere(2), box = testing::Box();
  cache.Put(1, sphere, Tagged(1, sphere.vertex_count()));
  cache.Put(2, sphere, Tagged(2, sphere.vertex_count()));
  ASSERT_TRUE(cache.Find(1, sphere).has_value());
  EXPECT_EQ(TagOf(*cache.Find(1, sphere)), 1);
  EXPECT_EQ(TagOf(*cache.Find(2, sphere)), 2);
  EXPECT_FALSE(cache.Find(3, sphere).has_value());
  EXPECT_FALSE(cache.Find(1, box).has_value());
  // What no rig depends on.
  EXPECT_TRUE(cache.Find(1, testing::WithAttributes(sphere)).has_value());
}

TEST(RigCacheTest, TheSmallestDifferenceIsAnotherMesh) {
  RigCache cache(kRoomy);
  const TriangleMesh mesh = testing::Icosphere(2);
  cache.Put(1, mesh, Tagged(1, mesh.vertex_count()));
  TriangleMesh moved = mesh;
  moved.positions(100, 2) = std::nextafter(moved.positions(100, 2), 10.0f);
  EXPECT_FALSE(cache.Find(1, moved).has_value());
  TriangleMesh turned = mesh;
  std::swap(turned.faces(7, 0), turned.faces(7, 1));
  EXPECT_FALSE(cache.Find(1, turned).has_value());
  TriangleMesh shorter = mesh;
  shorter.faces.conservativeResize(mesh.face_count() - 1, 3);
  EXPECT_FALSE(cache.Find(1, shorter).has_value());
}

TEST(RigCacheTest, ALaterPutReplacesTheEarlier) {
  RigCache cache(kRoomy);
  const TriangleMesh mesh = testing::Icosphere(1);
  cache.Put(1, mesh, Tagged(1, mesh.vertex_count()));
  const int64_t rough = cache.stats().bytes;
  CachedRig smooth = Tagged(2, mesh.vertex_count());
  smooth.smooth = std::make_shared<const RowMatrix>(smooth.rig->weights);
  cache.Put(1, mesh, smooth);
  EXPECT_EQ(TagOf(*cache.Find(1, mesh)), 2);
  EXPECT_EQ(cache.stats().entries, 1);
  EXPECT_EQ(cache.stats().bytes, rough + mesh.vertex_count() * 24 * 4);
  EXPECT_EQ(cache.stats().evictions, 0);
}

TEST(RigCacheTest, TheLeastRecentlyUsedLeavesAndBytesStayWithinTheBound) {
  const TriangleMesh base = testing::Icosphere(2);
  const auto nth = [&](int i) { return testing::Shifted(base, {static_cast<float>(i), 0, 0}); };
  int64_t entry = 0;
  {
    RigCache cache(kRoomy);
    cache.Put(1, base, Tagged(0, base.vertex_count()));
    entry = cache.stats().bytes;
  }
  EXPECT_GT(entry, base.vertex_count() * (12 + 24 + 96));
  RigCache cache(3 * entry + entry / 2);
  for (int i = 0; i < 3; ++i) cache.Put(1, nth(i), Tagged(static_cast<float>(i), base.vertex_count()));
  EXPECT_TRUE(cache.Find(1, nth(0)).has_value());  // so that 1 is the oldest
  cache.Put(1, nth(3), Tagged(3, base.vertex_count()));
  EXPECT_TRUE(cache.Find(1, nth(0)).has_value());
  EXPECT_FALSE(cache.Find(1, nth(1)).has_value());
  EXPECT_TRUE(cache.Find(1, nth(2)).has_value());
  EXPECT_EQ(cache.stats().evictions, 1);
  for (int i = 4; i < 40; ++i) {
    cache.Put(1, nth(i), Tagged(static_cast<float>(i), base.vertex_count()));
    EXPECT_LE(cache.stats().bytes, 3 * entry + entry / 2);
  }
  EXPECT_EQ(cache.stats().entries, 3);
}

TEST(RigCacheTest, WhatIsLargerThanTheCacheIsNotKept) {
  const TriangleMesh small = testing::Box(), large = testing::Icosphere(4);
  RigCache cache(100'000);
  cache.Put(1, small, Tagged(1, small.vertex_count()));
  cache.Put(1, large, Tagged(2, large.vertex_count()));
  EXPECT_FALSE(cache.Find(1, large).has_value());
  EXPECT_TRUE(cache.Find(1, small).has_value());
}

TEST(RigCacheTest, CountsHitsAndMissesAndForgetsARigger) {
  RigCache cache(kRoomy);
  const TriangleMesh mesh = testing::Box();
  EXPECT_FALSE(cache.Find(1, mesh).has_value());
  cache.Put(1, mesh, Tagged(1, mesh.vertex_count()));
  cache.Put(2, mesh, Tagged(2, mesh.vertex_count()));
  EXPECT_TRUE(cache.Find(1, mesh).has_value());
  EXPECT_TRUE(cache.Find(1, mesh).has_value());
  EXPECT_EQ(cache.stats().hits, 2);
  EXPECT_EQ(cache.stats().misses, 1);
  cache.Drop(1);
  EXPECT_FALSE(cache.Find(1, mesh).has_value());
  EXPECT_TRUE(cache.Find(2, mesh).has_value());
  cache.Drop(2);
  EXPECT_EQ(cache.stats().entries, 0);
  EXPECT_EQ(cache.stats().bytes, 0);
}

// Nobody gets another's rig, whoever finds, puts and evicts at the same time.
TEST(RigCacheTest, ThreadsGetTheirOwn) {
  const TriangleMesh base = testing::Icosphere(2);
  RigCache cache(80'000);  // three of eight
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 400; ++i) {
        const int tag = (i * (t + 1)) % 8;
        const TriangleMesh mesh = testing::Shifted(base, {static_cast<float>(tag), 0, 0});
        if (const auto found = cache.Find(1, mesh)) {
          EXPECT_EQ(TagOf(*found), static_cast<float>(tag));
        } else {
          cache.Put(1, mesh, Tagged(static_cast<float>(tag), mesh.vertex_count()));
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  const RigCache::Stats stats = cache.stats();
  EXPECT_EQ(stats.hits + stats.misses, 1600);
  EXPECT_GT(stats.hits, 0);
  EXPECT_GT(stats.evictions, 0);
  EXPECT_LE(stats.bytes, 80'000);
}

}  // namespace
}  // namespace stance

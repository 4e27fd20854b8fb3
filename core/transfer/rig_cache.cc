#include "core/transfer/rig_cache.h"

#include <cstring>
#include <iterator>
#include <string_view>
#include <utility>
#include <vector>

#include "absl/hash/hash.h"
#include "core/base/check.h"

namespace stance {
namespace {

// Of an entry besides its arrays: list and map nodes, allocators' headers.
constexpr int64_t kEntryBytes = 512;

template <typename Matrix>
std::string_view BytesOf(const Matrix& matrix) {
  return {reinterpret_cast<const char*>(matrix.data()),
          static_cast<size_t>(matrix.size()) * sizeof(typename Matrix::Scalar)};
}

template <typename T>
int64_t SizeOf(const std::vector<T>& values) {
  return std::ssize(values) * static_cast<int64_t>(sizeof(T));
}
template <typename Derived>
int64_t SizeOf(const Eigen::PlainObjectBase<Derived>& matrix) {
  return matrix.size() * static_cast<int64_t>(sizeof(typename Derived::Scalar));
}

int64_t SizeOf(const SampledWeights& sampled) {
  const SurfaceSamples& samples = sampled.samples;
  return SizeOf(sampled.weights) + SizeOf(samples.points) + SizeOf(samples.normals) +
         SizeOf(samples.graph.start) + SizeOf(samples.graph.column) + SizeOf(samples.graph.length) +
         SizeOf(samples.one_ring) + SizeOf(samples.place) + SizeOf(samples.cell) + SizeOf(samples.unreached);
}

int64_t SizeOf(const TriangleMesh& mesh, const CachedRig& cached) {
  const Rig& rig = *cached.rig;
  return kEntryBytes + SizeOf(mesh.positions) + SizeOf(mesh.faces) + SizeOf(rig.joints) +
         SizeOf(rig.weights) + (rig.sampled ? SizeOf(*rig.sampled) : 0) + SizeOf(rig.bones) +
         SizeOf(rig.rotations) + SizeOf(rig.confidence) + SizeOf(rig.features) +
         (cached.smooth ? SizeOf(*cached.smooth) : 0);
}

uint64_t KeyOf(uint64_t rigger, const TriangleMesh& mesh) {
  return absl::HashOf(rigger, BytesOf(mesh.positions), BytesOf(mesh.faces));
}

}  // namespace

bool SameSurface(const TriangleMesh& a, const TriangleMesh& b) {
  return BytesOf(a.positions) == BytesOf(b.positions) && BytesOf(a.faces) == BytesOf(b.faces);
}

std::optional<CachedRig> RigCache::Find(uint64_t rigger, const TriangleMesh& mesh) {
  const uint64_t key = KeyOf(rigger, mesh);
  std::shared_ptr<const TriangleMesh> known;
  CachedRig rig;
  {
    std::lock_guard<std::mutex> guard(mutex_);
    const auto it = by_key_.find(key);
    if (it != by_key_.end() && it->second->rigger == rigger) {
      entries_.splice(entries_.begin(), entries_, it->second);
      known = it->second->mesh;
      rig = it->second->rig;
    }
  }
  // Without the lock: a large mesh takes milliseconds.
  const bool hit = known != nullptr && SameSurface(*known, mesh);
  std::lock_guard<std::mutex> guard(mutex_);
  ++(hit ? stats_.hits : stats_.misses);
  if (!hit) return std::nullopt;
  return rig;
}

void RigCache::Put(uint64_t rigger, const TriangleMesh& mesh, CachedRig rig) {
  STANCE_CHECK(rig.rig != nullptr);
  const uint64_t key = KeyOf(rigger, mesh);
  const int64_t bytes = SizeOf(mesh, rig);
  if (bytes > max_bytes_) return;
  TriangleMesh surface;
  surface.positions = mesh.positions;
  surface.faces = mesh.faces;
  auto known = std::make_shared<const TriangleMesh>(std::move(surface));
  std::lock_guard<std::mutex> guard(mutex_);
  if (const auto it = by_key_.find(key); it != by_key_.end()) EraseLocked(it->second);
  while (stats_.bytes + bytes > max_bytes_) {
    EraseLocked(std::prev(entries_.end()));
    ++stats_.evictions;
  }
  entries_.push_front({key, rigger, std::move(known), std::move(rig), bytes});
  by_key_[key] = entries_.begin();
  stats_.bytes += bytes;
}

void RigCache::Drop(uint64_t rigger) {
  std::lock_guard<std::mutex> guard(mutex_);
  for (auto entry = entries_.begin(); entry != entries_.end();) {
    const auto next = std::next(entry);
    if (entry->rigger == rigger) EraseLocked(entry);
    entry = next;
  }
}

RigCache::Stats RigCache::stats() const {
  std::lock_guard<std::mutex> guard(mutex_);
  Stats stats = stats_;
  stats.entries = std::ssize(entries_);
  return stats;
}

void RigCache::EraseLocked(Entries::iterator entry) {
  stats_.bytes -= entry->bytes;
  by_key_.erase(entry->key);
  entries_.erase(entry);
}

}  // namespace stance

// Rigs of meshes that were rigged before.
#pragma once

#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <optional>
#include <unordered_map>

#include "core/mesh/triangle_mesh.h"
#include "core/transfer/options.h"
#include "core/transfer/parts.h"

namespace stance {

// What is known of one mesh; shared between all who use it.
struct CachedRig {
  std::shared_ptr<const Rig> rig;             // as the rigger made it
  std::shared_ptr<const RowMatrix> smooth{};  // (V, J) its smooth weights; null until someone needed them
  SmoothingOptions smoothing{};               // what `smooth` was made with
};

// Holds rigs by their meshes' content, the least recently used leaving first.
//
// An entry keeps the mesh's positions and faces and is found only by equal ones, so that nobody can be given
// the rig of another mesh, whatever collisions of the hash he makes: those cost hits. Invariant:
// stats().bytes
// <= max_bytes. Thread-safe.
class RigCache {
 public:
  struct Stats {
    int64_t hits = 0;
    int64_t misses = 0;
    int64_t evictions = 0;  // entries that left for want of room
    int64_t entries = 0;
    int64_t bytes = 0;
  };

  explicit RigCache(int64_t max_bytes) : max_bytes_(max_bytes) {}

  // The rig of a mesh with the same positions and faces, bit for bit, by the same `rigger`: a number of the
  // caller's for what else a rig depends on.
  std::optional<CachedRig> Find(uint64_t rigger, const TriangleMesh& mesh);

  // Keeps the rig, in place of what was known of the mesh, unless it is larger than the whole cache.
  // REQUIRES: rig.rig is not null.
  void Put(uint64_t rigger, const TriangleMesh& mesh, CachedRig rig);

  // Forgets everything by `rigger`.
  void Drop(uint64_t rigger);

  Stats stats() const;

 private:
  struct Entry {
    uint64_t key;
    uint64_t rigger;
    std::shared_ptr<const TriangleMesh> mesh;  // positions and faces only
    CachedRig rig;
    int64_t bytes;
  };
  using Entries = std::list<Entry>;

  void EraseLocked(Entries::iterator entry);

  const int64_t max_bytes_;
  mutable std::mutex mutex_;
  // Protected by mutex_:
  Entries entries_;  // the most recently used first
  std::unordered_map<uint64_t, Entries::iterator> by_key_;
  Stats stats_;
};

// Whether positions and faces are equal, bit for bit.
bool SameSurface(const TriangleMesh& a, const TriangleMesh& b);

}  // namespace stance

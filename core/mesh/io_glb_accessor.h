// Bounds-checked views into a GLB's JSON and binary chunks.
#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/status.h"

namespace stance {

// The two chunks of a GLB; `binary` points into the bytes that were split.
struct GlbChunks {
  nlohmann::json root;  // an object
  std::string_view binary;
};

// INVALID_ARGUMENT for anything but a GLB of version 2 with well-formed, not absurdly nested JSON.
absl::StatusOr<GlbChunks> SplitGlb(std::string_view bytes);

// The member, or null if `object` is none or has no such member.
const nlohmann::json* FindMember(const nlohmann::json& object, const char* key);

// The member as an integer in [0, limit), `fallback` where there is none. `where` names the object in the
// error.
absl::StatusOr<int64_t> IntegerMember(const nlohmann::json& object, const char* key, int64_t fallback,
                                      int64_t limit, const std::string& where);

// Element `index` of the root's array `array`, an object.
absl::StatusOr<const nlohmann::json*> Item(const GlbChunks& glb, const char* array, int64_t index);

// How many elements the root's array has (0 if there is none).
int64_t ItemCount(const GlbChunks& glb, const char* array);

// An accessor's elements; every one lies inside the binary chunk.
class GlbAccessor {
 public:
  // INVALID_ARGUMENT for an accessor that is out of bounds, sparse, compressed, without data or not of `type`
  // ("SCALAR", "VEC2", "VEC3").
  static absl::StatusOr<GlbAccessor> Find(const GlbChunks& glb, int64_t index, std::string_view type);

  int64_t count() const { return count_; }
  bool is_unsigned_integer() const;

  // REQUIRES: 0 <= row < count(), component within the type. Normalised integers become reals in [-1, 1].
  float Real(int64_t row, int component) const;
  // REQUIRES: is_unsigned_integer().
  int64_t Index(int64_t row) const;

 private:
  const char* At(int64_t row, int component) const;

  const char* data_ = nullptr;
  int64_t count_ = 0;
  int64_t stride_ = 0;
  int component_type_ = 0;
  bool normalized_ = false;
};

}  // namespace stance

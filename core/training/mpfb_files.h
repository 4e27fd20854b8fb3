// Readers of MPFB's file formats.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/base/types.h"
#include "core/skeleton/skeleton.h"

namespace stance {

// base.obj: the body and its helpers (clothes' proxies, joint cubes).
struct MpfbBase {
  Points vertices;                                     // metres, y up
  Faces body;                                          // the group "body", quads split in two
  int body_vertices = 0;                               // the body's vertices are 0 .. body_vertices - 1
  std::map<std::string, std::vector<int32_t>> groups;  // the vertices of each group, ascending
};
absl::StatusOr<MpfbBase> ReadMpfbBase(const std::filesystem::path& path);

// A target file: (base vertices, 3) displacements, metres.
absl::StatusOr<Points> ReadMpfbTarget(const std::filesystem::path& path, int64_t base_vertices);

// The vertices whose mean is each canonical joint's place, from rig.mixamo.json's vertex strategies: its
// default positions belong to another body.
using JointVertices = std::array<std::vector<int32_t>, kHumanJoints>;
absl::StatusOr<JointVertices> ReadMpfbJoints(const std::filesystem::path& path, const MpfbBase& base);

// weights.mixamo.json as (body_vertices, 24) raw sums: fingers join the hands, but thumbs the wrists (a thumb
// that moved with the fingers would twist in every grip).
absl::StatusOr<RowMatrix> ReadMpfbWeights(const std::filesystem::path& path, int body_vertices);

}  // namespace stance

// A rigged character as a file that other tools load.
#pragma once

#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/mesh/triangle_mesh.h"
#include "core/skeleton/skeleton.h"
#include "core/transfer/parts.h"

namespace stance {

// The bytes of a GLB (glTF 2.0) with the mesh, its skeleton and their binding. The present pose is the rest
// pose: every joint's local transform is a translation only. A vertex keeps its four largest weights, made to
// sum to 1 (glTF's first set of joints holds four). Normals are computed where the mesh has none. The joints
// are named by `bone_names` (see HumanBoneNames), or as in the skeleton if that is empty.
//
// INVALID_ARGUMENT for a mesh that SerializeMesh can't write, more than 255 joints, joints, weights or names
// that don't match the skeleton and the mesh, a non-finite joint, or a vertex whose weights are negative, not
// finite or all zero.
absl::StatusOr<std::string> SerializeSkinnedGlb(const TriangleMesh& mesh, const Skeleton& skeleton,
                                                const Rig& rig,
                                                const std::vector<std::string>& bone_names = {});

}  // namespace stance

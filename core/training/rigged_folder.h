// Folders of rigged characters as identities for training and test.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/training/rigged_body.h"

namespace stance {

struct RiggedFolder {
  std::vector<RiggedBody> bodies;    // in the order of their names
  std::vector<std::string> refused;  // a line per file that is no usable character: its path and why
};

// Whether the file at that place of its folder's sorted names is kept for tests: the fifth of every ten.
inline bool IsHeldOut(size_t place) { return place % 10 == 4; }

// Reads all .fbx, .glb and .gltf files of the folder; which are held out depends on their names alone, read
// or refused. NOT_FOUND if there is no such folder or no such file in it; UNIMPLEMENTED as ReadRiggedMesh.
absl::StatusOr<RiggedFolder> ReadRiggedFolder(const std::filesystem::path& folder, const RestBody& neutral);

}  // namespace stance

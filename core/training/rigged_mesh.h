// Rigged characters from other tools' files, as they are there.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/base/types.h"

namespace stance {

// A bone of a file's own skeleton.
struct FileBone {
  std::string name;
  int parent = -1;                                 // the nearest ancestor that is a bone; -1: none
  Eigen::Vector3f head = Eigen::Vector3f::Zero();  // where it begins, as positions
};

// All skinned parts of a file as one mesh in the bind pose. Metres; axes are the file's.
struct RiggedMesh {
  Points positions;  // (V, 3), one vertex per place
  Faces faces;       // with three different corners each
  RowMatrix
      weights;  // (V, B), non-negative; rows sum to 1, or are 0 where the file binds the vertex to nothing
  std::vector<FileBone> bones;  // (B), parents first
};

// Reads an FBX, glTF or other file that assimp knows. Parts without bones are skipped; vertices that coincide
// become one, with the mean of their weights. NOT_FOUND for a missing file; INVALID_ARGUMENT, with the path,
// for one that can't be read or holds no skinned mesh; UNIMPLEMENTED where Stance was built without assimp.
absl::StatusOr<RiggedMesh> ReadRiggedMesh(const std::filesystem::path& path);

}  // namespace stance

// In place of rigged_mesh.cc where CMake finds no assimp.
#include "core/training/rigged_mesh.h"

namespace stance {

absl::StatusOr<RiggedMesh> ReadRiggedMesh(const std::filesystem::path& /*path*/) {
  return absl::UnimplementedError("rigged characters can't be read: this build is without assimp");
}

}  // namespace stance

#include "core/training/rigged_folder.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <system_error>
#include <utility>

#include "core/training/rigged_mesh.h"

namespace stance {
namespace {

constexpr std::array kExtensions = {".fbx", ".glb", ".gltf"};

absl::StatusOr<RiggedBody> ReadBody(const std::filesystem::path& file, const RestBody& neutral) {
  STANCE_ASSIGN_OR_RETURN(const RiggedMesh mesh, ReadRiggedMesh(file));
  absl::StatusOr<RiggedBody> body = MakeRiggedBody(mesh, neutral);
  if (body.ok()) return body;
  const std::string reason(body.status().message());
  return absl::InvalidArgumentError(fmt::format("{}: {}", file.string(), reason));
}

}  // namespace

absl::StatusOr<RiggedFolder> ReadRiggedFolder(const std::filesystem::path& folder, const RestBody& neutral) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::string extension = entry.path().extension().string();
    if (std::find(kExtensions.begin(), kExtensions.end(), extension) != kExtensions.end()) {
      files.push_back(entry.path());
    }
  }
  if (files.empty()) return absl::NotFoundError(fmt::format("{}: no rigged characters", folder.string()));
  std::sort(files.begin(), files.end());

  RiggedFolder result;
  for (size_t i = 0; i < files.size(); ++i) {
    absl::StatusOr<RiggedBody> body = ReadBody(files[i], neutral);
    if (absl::IsUnimplemented(body.status())) return body.status();
    if (!body.ok()) {
      result.refused.emplace_back(body.status().message());
      continue;
    }
    const auto& file = files[i];
    body->name = fmt::format("{}/{}", file.parent_path().filename().string(), file.stem().string());
    body->held_out = IsHeldOut(i);
    result.bodies.push_back(*std::move(body));
  }
  return result;
}

}  // namespace stance

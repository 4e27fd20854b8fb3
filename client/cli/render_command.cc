#include <filesystem>
#include <numbers>

#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/input.h"
#include "client/cli/output_files.h"
#include "client/cli/view.h"

namespace stance {

absl::Status RunRender(const RenderArguments& arguments) {
  STANCE_RETURN_IF_ERROR(FileError(OutputFiles::Check(arguments.output)));
  std::vector<TriangleMesh> meshes;
  for (const std::string& path : arguments.meshes) {
    STANCE_ASSIGN_OR_RETURN(TriangleMesh mesh, ReadInput(path));
    STANCE_RETURN_IF_ERROR(CheckInput(path, mesh).status());
    meshes.push_back(std::move(mesh));
  }
  std::vector<ViewItem> items;
  for (size_t i = 0; i < meshes.size(); ++i) {
    const std::string caption = arguments.captions.empty()
                                    ? std::filesystem::path(arguments.meshes[i]).stem().string()
                                    : arguments.captions[i];
    items.push_back({&meshes[i], arguments.up, caption});
  }
  ViewCamera camera;
  if (arguments.yaw) camera.yaw = *arguments.yaw * std::numbers::pi / 180;
  if (arguments.pitch) camera.pitch = *arguments.pitch * std::numbers::pi / 180;
  camera.columns = arguments.columns;
  OutputFiles files;
  STANCE_RETURN_IF_ERROR(FileError(files.StageWith(arguments.output, [&](const std::filesystem::path& path) {
    return WriteViewPng(items, camera, path);
  })));
  return FileError(files.Commit());
}

}  // namespace stance

#include "core/training/checkpoint.h"

#include <fmt/format.h>

#include <sstream>

#include "core/base/files.h"

namespace stance {

namespace {

int TakeMatching(torch::serialize::InputArchive& archive, torch::nn::Module& module) {
  const torch::NoGradGuard no_grad;
  int taken = 0;
  const auto take = [&](const auto& tensors, bool buffer) {
    for (const auto& item : tensors) {
      torch::Tensor saved;
      if (!archive.try_read(item.key(), saved, buffer) || saved.sizes() != item.value().sizes()) continue;
      torch::Tensor(item.value()).copy_(saved);
      ++taken;
    }
  };
  take(module.named_parameters(/*recurse=*/false), /*buffer=*/false);
  take(module.named_buffers(/*recurse=*/false), /*buffer=*/true);
  for (const auto& child : module.named_children()) {
    torch::serialize::InputArchive part;
    if (archive.try_read(child.key(), part)) taken += TakeMatching(part, *child.value());
  }
  return taken;
}

}  // namespace

absl::Status SaveCheckpoint(const std::filesystem::path& path, const NamedModules& modules, AdamW* optimizer,
                            const TrainingProgress& progress) {
  try {
    torch::serialize::OutputArchive archive;
    for (const auto& [name, module] : modules) {
      torch::serialize::OutputArchive part;
      module->save(part);
      archive.write(name, part);
    }
    torch::serialize::OutputArchive optimizer_part;
    if (optimizer != nullptr) optimizer->Save(optimizer_part);
    archive.write("optimizer", optimizer_part);
    archive.write(
        "progress",
        torch::tensor({static_cast<double>(progress.seen), static_cast<double>(progress.samples_per_mesh),
                       static_cast<double>(progress.max_ring), progress.seconds,
                       progress.features.normals ? 1.0 : 0.0, progress.features.geodesic ? 1.0 : 0.0},
                      torch::kFloat64));
    std::ostringstream bytes;
    archive.save_to(bytes);
    return WriteFile(path, bytes.str());
  } catch (const std::exception& error) {
    return absl::InternalError(fmt::format("{}: {}", path.string(), error.what()));
  }
}

absl::StatusOr<TrainingProgress> LoadCheckpoint(const std::filesystem::path& path,
                                                const NamedModules& modules, AdamW* optimizer,
                                                torch::Device device) {
  STANCE_ASSIGN_OR_RETURN(const std::string bytes, ReadFile(path));
  try {
    std::istringstream in(bytes);
    torch::serialize::InputArchive archive;
    archive.load_from(in, device);
    for (const auto& [name, module] : modules) {
      torch::serialize::InputArchive part;
      archive.read(name, part);
      module->load(part);
    }
    if (optimizer != nullptr) {
      torch::serialize::InputArchive part;
      archive.read("optimizer", part);
      optimizer->Load(part);
    }
    torch::Tensor values;
    archive.read("progress", values);
    values = values.cpu();
    const auto access = values.accessor<double, 1>();
    TrainingProgress progress{static_cast<int64_t>(access[0]),
                              static_cast<int64_t>(access[1]),
                              static_cast<int64_t>(access[2]),
                              access[3],
                              {}};
    // Older checkpoints don't say, and saw all.
    if (access.size(0) > 4) progress.features = {access[4] != 0, access[5] != 0};
    return progress;
  } catch (const std::exception& error) {
    return absl::DataLossError(fmt::format("{}: {}", path.string(), error.what()));
  }
}

absl::StatusOr<int> LoadMatching(const std::filesystem::path& path, const NamedModules& modules,
                                 torch::Device device) {
  STANCE_ASSIGN_OR_RETURN(const std::string bytes, ReadFile(path));
  try {
    std::istringstream in(bytes);
    torch::serialize::InputArchive archive;
    archive.load_from(in, device);
    int taken = 0;
    for (const auto& [name, module] : modules) {
      torch::serialize::InputArchive part;
      if (archive.try_read(name, part)) taken += TakeMatching(part, *module);
    }
    return taken;
  } catch (const std::exception& error) {
    return absl::DataLossError(fmt::format("{}: not a readable checkpoint: {}", path.string(), error.what()));
  }
}

}  // namespace stance

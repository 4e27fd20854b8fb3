#include "core/training/checkpoint.h"

#include <fmt/format.h>

#include <sstream>

#include "core/base/files.h"

namespace stance {

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
    archive.write("progress", torch::tensor({static_cast<double>(progress.seen),
                                             static_cast<double>(progress.samples_per_mesh),
                                             static_cast<double>(progress.max_ring), progress.seconds},
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
    return TrainingProgress{static_cast<int64_t>(access[0]), static_cast<int64_t>(access[1]),
                            static_cast<int64_t>(access[2]), access[3]};
  } catch (const std::exception& error) {
    return absl::DataLossError(fmt::format("{}: {}", path.string(), error.what()));
  }
}

}  // namespace stance

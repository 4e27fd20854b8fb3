// A method's model with the parts that it is composed of.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <utility>
#include <vector>

#include "core/base/status.h"
#include "core/transfer/options.h"
#include "core/transfer/parts.h"
#include "core/transfer/pipeline.h"

namespace stance {

// Thread-safe: every part is pure.
class LoadedMethod {
 public:
  // Loads the model in `model_dir` with the parts of the method that its manifest names. Errors as
  // Pipeline::Load.
  static absl::StatusOr<std::unique_ptr<LoadedMethod>> Load(const std::filesystem::path& model_dir,
                                                            const PipelineOptions& options);
  virtual ~LoadedMethod() = default;

  const ModelInfo& info() const { return info_; }
  // Of no other method that this process has loaded or will load, not even of the same model.
  uint64_t id() const { return id_; }

  virtual const Rigger& rigger() const = 0;
  // A method has either a solver, whose transforms the weights blend, or a deformer of its own; null stands
  // for the one that it lacks.
  virtual std::unique_ptr<PoseSolver> MakeSolver(const TransferOptions& options) const = 0;
  virtual const PairDeformer* deformer() const { return nullptr; }
  virtual std::unique_ptr<WeightSmoother> MakeWeightSmoother(const TransferOptions& options) const = 0;

 protected:
  explicit LoadedMethod(ModelInfo info);

 private:
  const ModelInfo info_;
  const uint64_t id_;
};

// Those of every model in `folders`, the default one first. At least one, none twice; errors as
// Pipeline::Load.
absl::StatusOr<std::vector<std::unique_ptr<LoadedMethod>>> LoadMethods(
    const std::vector<std::filesystem::path>& folders, const PipelineOptions& options);

}  // namespace stance

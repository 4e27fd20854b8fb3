// The files of a model directory: manifest.json and the weights beside it. Includes Torch.
#pragma once

#include <filesystem>

#include "core/base/status.h"
#include "core/network/model_manifest.h"
#include "core/network/safetensors.h"

namespace stance {

// Prefixes of the two networks' tensors in the weights file.
inline constexpr char kWeightNetworkPrefix[] = "f_c.";
inline constexpr char kJointNetworkPrefix[] = "f_j.";
// Of METHOD_STANCE's network.
inline constexpr char kPoseNetworkPrefix[] = "pose.";
// Of the network that refines what it finds; models may lack it.
inline constexpr char kRefinementNetworkPrefix[] = "refinement.";
// Of METHOD_NEURAL's branches.
inline constexpr char kRiggingBranchPrefix[] = "rigging.";
inline constexpr char kTransferBranchPrefix[] = "transfer.";

// Reads the weights file that the manifest names; DATA_LOSS if its checksum differs.
absl::StatusOr<TensorMap> ReadWeights(const std::filesystem::path& dir, const ModelManifest& manifest);

// Writes both files, the manifest last, each aside and then renamed. Fills in the checksum.
absl::Status WriteModel(const std::filesystem::path& dir, ModelManifest manifest, const TensorMap& tensors);

}  // namespace stance

// Named tensors in the safetensors file format: an 8-byte header length, a JSON header, raw little-endian
// data. Includes Torch.
#pragma once

#include <torch/torch.h>

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "core/base/status.h"

namespace stance {

using TensorMap = std::map<std::string, torch::Tensor>;

// float32 and float16 tensors are written as they are.
std::string SerializeTensors(const TensorMap& tensors);

// DATA_LOSS, saying what is wrong, for bytes that are not a whole safetensors file. Never reads past them.
absl::StatusOr<TensorMap> ParseTensors(std::string_view bytes);

// A module's parameters and floating-point buffers by their dotted names, float16 if `half`.
TensorMap ModuleTensors(const torch::nn::Module& module, const std::string& prefix, bool half);

// Copies the tensors into the module. INVALID_ARGUMENT naming the tensor that is missing or has another
// shape.
absl::Status LoadModule(torch::nn::Module& module, const std::string& prefix, const TensorMap& tensors);

// Whether any tensor is of the module of that prefix.
bool HasModule(const TensorMap& tensors, const std::string& prefix);

}  // namespace stance

#include "core/network/safetensors.h"

#include <fmt/format.h>

#include <cstring>
#include <nlohmann/json.hpp>

namespace stance {
namespace {

using nlohmann::json;

std::string ShapeText(const torch::Tensor& tensor) {
  std::string text = "[";
  for (int64_t i = 0; i < tensor.dim(); ++i) text += fmt::format("{}{}", i ? ", " : "", tensor.size(i));
  return text + "]";
}

absl::StatusOr<torch::Tensor> ParseOne(const std::string& name, const json& entry, std::string_view data) {
  const auto bad = [&](const std::string& why) {
    return absl::DataLossError(fmt::format("tensor '{}': {}", name, why));
  };
  if (!entry.is_object() || !entry.contains("dtype") || !entry.contains("shape") ||
      !entry.contains("data_offsets")) {
    return bad("header entry without dtype, shape or data_offsets");
  }
  const auto dtype = entry["dtype"].is_string() ? entry["dtype"].get<std::string>() : "";
  if (dtype != "F32" && dtype != "F16") return bad("dtype '" + dtype + "' is neither F32 nor F16");
  const auto& shape = entry["shape"];
  const auto& range = entry["data_offsets"];
  if (!shape.is_array() || shape.size() > 8 || !range.is_array() || range.size() != 2 ||
      !range[0].is_number_unsigned() || !range[1].is_number_unsigned()) {
    return bad("malformed shape or data_offsets");
  }
  std::vector<int64_t> sizes;
  uint64_t count = 1;
  for (const auto& size : shape) {
    if (!size.is_number_unsigned() || size.get<uint64_t>() > data.size()) return bad("impossible shape");
    sizes.push_back(size.get<int64_t>());
    count *= size.get<uint64_t>();
    if (count > data.size()) return bad("shape larger than the file");
  }
  const auto begin = range[0].get<uint64_t>(), end = range[1].get<uint64_t>();
  const uint64_t width = dtype == "F32" ? 4 : 2;
  if (begin > end || end > data.size() || end - begin != count * width)
    return bad("data_offsets don't fit the shape");
  auto tensor = torch::empty(sizes, dtype == "F32" ? torch::kFloat32 : torch::kFloat16);
  if (end > begin) std::memcpy(tensor.data_ptr(), data.data() + begin, end - begin);
  return tensor;
}

}  // namespace

std::string SerializeTensors(const TensorMap& tensors) {
  json header = json::object();
  std::string data;
  for (const auto& [name, value] : tensors) {
    const auto tensor = value.detach().cpu().contiguous();
    const size_t begin = data.size();
    data.append(static_cast<const char*>(tensor.data_ptr()), tensor.nbytes());
    header[name] = {{"dtype", tensor.scalar_type() == torch::kFloat16 ? "F16" : "F32"},
                    {"shape", tensor.sizes().vec()},
                    {"data_offsets", {begin, data.size()}}};
  }
  std::string text = header.dump();
  text.append((8 - text.size() % 8) % 8, ' ');
  const uint64_t length = text.size();
  std::string bytes(reinterpret_cast<const char*>(&length), sizeof(length));
  return bytes + text + data;
}

absl::StatusOr<TensorMap> ParseTensors(std::string_view bytes) {
  uint64_t length = 0;
  if (bytes.size() < sizeof(length)) return absl::DataLossError("shorter than a safetensors header");
  std::memcpy(&length, bytes.data(), sizeof(length));
  if (length > bytes.size() - sizeof(length))
    return absl::DataLossError("safetensors header runs past the end");
  const json header = json::parse(bytes.substr(sizeof(length), length), nullptr, /*allow_exceptions=*/false);
  if (!header.is_object()) return absl::DataLossError("safetensors header is not a JSON object");
  const std::string_view data = bytes.substr(sizeof(length) + length);
  TensorMap tensors;
  for (const auto& [name, entry] : header.items()) {
    if (name == "__metadata__") continue;
    STANCE_ASSIGN_OR_RETURN(tensors[name], ParseOne(name, entry, data));
  }
  return tensors;
}

TensorMap ModuleTensors(const torch::nn::Module& module, const std::string& prefix, bool half) {
  TensorMap tensors;
  const auto type = half ? torch::kFloat16 : torch::kFloat32;
  for (const auto& item : module.named_parameters())
    tensors[prefix + item.key()] = item.value().detach().to(type);
  for (const auto& item : module.named_buffers()) {
    // num_batches_tracked, the only integer one, is of no use to inference.
    if (item.value().is_floating_point()) tensors[prefix + item.key()] = item.value().detach().to(type);
  }
  return tensors;
}

absl::Status LoadModule(torch::nn::Module& module, const std::string& prefix, const TensorMap& tensors) {
  torch::NoGradGuard no_grad;
  const auto copy = [&](const std::string& key, torch::Tensor target) -> absl::Status {
    const auto it = tensors.find(prefix + key);
    if (it == tensors.end())
      return absl::InvalidArgumentError(fmt::format("tensor '{}{}' is missing", prefix, key));
    if (it->second.sizes() != target.sizes()) {
      return absl::InvalidArgumentError(fmt::format("tensor '{}{}' has shape {}, the network needs {}",
                                                    prefix, key, ShapeText(it->second), ShapeText(target)));
    }
    if (!torch::isfinite(it->second).all().item<bool>()) {
      return absl::InvalidArgumentError(
          fmt::format("tensor '{}{}' holds a value that is not finite", prefix, key));
    }
    target.copy_(it->second);
    return absl::OkStatus();
  };
  for (const auto& item : module.named_parameters()) STANCE_RETURN_IF_ERROR(copy(item.key(), item.value()));
  for (const auto& item : module.named_buffers()) {
    if (item.value().is_floating_point()) STANCE_RETURN_IF_ERROR(copy(item.key(), item.value()));
  }
  return absl::OkStatus();
}

bool HasModule(const TensorMap& tensors, const std::string& prefix) {
  const auto first = tensors.lower_bound(prefix);
  return first != tensors.end() && first->first.starts_with(prefix);
}

}  // namespace stance

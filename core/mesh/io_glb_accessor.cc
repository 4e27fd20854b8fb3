#include "core/mesh/io_glb_accessor.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/check.h"
#include "core/mesh/io_bytes.h"

namespace stance {
namespace {

using Json = nlohmann::json;

constexpr uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;
constexpr size_t kHeaderBytes = 12, kChunkHeaderBytes = 8;
// Meshes, nodes and extensions nest about ten deep; the bound keeps a document of brackets from growing.
constexpr int kDeepestJson = 64;
// A mesh's own JSON takes some kilobytes, a scene's some megabytes; as values it takes up to twenty times its
// bytes.
constexpr size_t kLargestJson = size_t{16} << 20;
constexpr int64_t kLargestStride = 252;

constexpr int kByte = 5120, kUnsignedByte = 5121, kShort = 5122, kUnsignedShort = 5123, kUnsignedInt = 5125,
              kFloat = 5126;

absl::Status Invalid(const std::string& text) { return absl::InvalidArgumentError("GLB: " + text); }

int64_t ComponentBytes(int64_t component_type) {
  switch (component_type) {
    case kByte:
    case kUnsignedByte:
      return 1;
    case kShort:
    case kUnsignedShort:
      return 2;
    case kUnsignedInt:
    case kFloat:
      return 4;
    default:
      return 0;
  }
}

bool IsNestedTooDeep(std::string_view json) {
  int depth = 0;
  bool quoted = false;
  for (size_t k = 0; k < json.size(); ++k) {
    const char c = json[k];
    if (quoted) {
      if (c == '\\') ++k;
      if (c == '"') quoted = false;
    } else if (c == '"') {
      quoted = true;
    } else if (c == '[' || c == '{') {
      if (++depth > kDeepestJson) return true;
    } else if (c == ']' || c == '}') {
      --depth;
    }
  }
  return false;
}

}  // namespace

absl::StatusOr<GlbChunks> SplitGlb(std::string_view bytes) {
  const auto word = [&](size_t at) { return LoadLittleEndian<uint32_t>(bytes.data() + at); };
  if (bytes.size() < kHeaderBytes || word(0) != kMagic) return Invalid("the file does not begin with 'glTF'");
  if (word(4) != 2) return Invalid(fmt::format("version {} is not supported (2 is)", word(4)));
  if (word(8) > bytes.size() || word(8) < kHeaderBytes) {
    return Invalid(fmt::format("the header announces {} bytes, the file has {}", word(8), bytes.size()));
  }
  bytes = bytes.substr(0, word(8));

  std::string_view json, binary;
  bool has_json = false, has_binary = false;
  for (size_t at = kHeaderBytes; at + kChunkHeaderBytes <= bytes.size();) {
    const size_t length = word(at);
    const uint32_t type = word(at + 4);
    at += kChunkHeaderBytes;
    if (length > bytes.size() - at) {
      return Invalid(fmt::format("a chunk of {} bytes at {} reaches beyond the file's end", length, at));
    }
    if (type == kJsonChunk && !has_json) {
      json = bytes.substr(at, length);
      has_json = true;
    } else if (type == kBinaryChunk && !has_binary) {
      binary = bytes.substr(at, length);
      has_binary = true;
    }
    at += length;
  }
  if (!has_json) return Invalid("there is no JSON chunk");
  if (json.size() > kLargestJson) {
    return Invalid(
        fmt::format("a JSON chunk of {} bytes; at most {} are accepted", json.size(), kLargestJson));
  }
  if (IsNestedTooDeep(json)) return Invalid(fmt::format("JSON nested more than {} deep", kDeepestJson));
  GlbChunks chunks;
  chunks.root = Json::parse(json.begin(), json.end(), nullptr, /*allow_exceptions=*/false);
  chunks.binary = binary;
  if (!chunks.root.is_object()) return Invalid("the JSON chunk is not a well-formed object");
  return chunks;
}

const Json* FindMember(const Json& object, const char* key) {
  if (!object.is_object()) return nullptr;
  const auto place = object.find(key);
  return place == object.end() ? nullptr : &*place;
}

absl::StatusOr<int64_t> IntegerMember(const Json& object, const char* key, int64_t fallback, int64_t limit,
                                      const std::string& where) {
  const Json* const member = FindMember(object, key);
  if (member == nullptr) return fallback;
  // A number written without sign, point or exponent.
  if (!member->is_number_unsigned())
    return Invalid(fmt::format("{}: '{}' is not a whole number", where, key));
  const uint64_t value = member->get<uint64_t>();
  if (limit <= 0 || value >= static_cast<uint64_t>(limit)) {
    return Invalid(fmt::format("{}: '{}' is {}, which is out of range", where, key, value));
  }
  return static_cast<int64_t>(value);
}

int64_t ItemCount(const GlbChunks& glb, const char* array) {
  const Json* const items = FindMember(glb.root, array);
  return items != nullptr && items->is_array() ? static_cast<int64_t>(items->size()) : 0;
}

absl::StatusOr<const Json*> Item(const GlbChunks& glb, const char* array, int64_t index) {
  if (index < 0 || index >= ItemCount(glb, array)) {
    return Invalid(fmt::format("{}[{}] does not exist", array, index));
  }
  const Json& item = glb.root.find(array)->at(static_cast<size_t>(index));
  if (!item.is_object()) return Invalid(fmt::format("{}[{}] is not an object", array, index));
  return &item;
}

absl::StatusOr<GlbAccessor> GlbAccessor::Find(const GlbChunks& glb, int64_t index, std::string_view type) {
  const std::string where = fmt::format("accessors[{}]", index);
  STANCE_ASSIGN_OR_RETURN(const Json* const json, Item(glb, "accessors", index));
  const Json* const written_type = FindMember(*json, "type");
  if (written_type == nullptr || !written_type->is_string() ||
      written_type->get_ref<const std::string&>() != type) {
    return Invalid(fmt::format("{}: 'type' is not {}", where, type));
  }
  if (FindMember(*json, "sparse") != nullptr) return Invalid(where + ": sparse accessors are not supported");
  if (FindMember(*json, "bufferView") == nullptr) {
    return Invalid(where + ": there is no 'bufferView' (compressed meshes are not supported)");
  }

  GlbAccessor accessor;
  const int64_t components = type == "SCALAR" ? 1 : type == "VEC2" ? 2 : 3;
  STANCE_ASSIGN_OR_RETURN(const int64_t component_type,
                          IntegerMember(*json, "componentType", 0, 1 << 16, where));
  const int64_t component_bytes = ComponentBytes(component_type);
  if (component_bytes == 0)
    return Invalid(fmt::format("{}: unknown 'componentType' {}", where, component_type));
  accessor.component_type_ = static_cast<int>(component_type);
  const Json* const normalized = FindMember(*json, "normalized");
  accessor.normalized_ = normalized != nullptr && normalized->is_boolean() && normalized->get<bool>();

  // The view must lie in the chunk, the elements in the view. No number exceeds the chunk's size (32 bits),
  // so that no product overflows.
  const int64_t size = std::ssize(glb.binary);
  STANCE_ASSIGN_OR_RETURN(accessor.count_, IntegerMember(*json, "count", 0, size + 1, where));
  STANCE_ASSIGN_OR_RETURN(const int64_t offset, IntegerMember(*json, "byteOffset", 0, size + 1, where));
  STANCE_ASSIGN_OR_RETURN(const int64_t view_index, IntegerMember(*json, "bufferView", 0, size + 1, where));
  STANCE_ASSIGN_OR_RETURN(const Json* const view, Item(glb, "bufferViews", view_index));
  const std::string view_where = fmt::format("bufferViews[{}]", view_index);
  if (const Json* const extensions = FindMember(*view, "extensions");
      extensions != nullptr && FindMember(*extensions, "EXT_meshopt_compression") != nullptr) {
    return Invalid(view_where + ": meshopt compression is not supported");
  }
  STANCE_ASSIGN_OR_RETURN(const int64_t buffer,
                          IntegerMember(*view, "buffer", 0, int64_t{1} << 32, view_where));
  STANCE_ASSIGN_OR_RETURN(const Json* const buffer_json, Item(glb, "buffers", buffer));
  if (buffer != 0 || FindMember(*buffer_json, "uri") != nullptr) {
    return Invalid(fmt::format("{}: buffers[{}] is not the file's own binary chunk", view_where, buffer));
  }
  STANCE_ASSIGN_OR_RETURN(const int64_t view_offset,
                          IntegerMember(*view, "byteOffset", 0, size + 1, view_where));
  STANCE_ASSIGN_OR_RETURN(const int64_t view_length,
                          IntegerMember(*view, "byteLength", 0, size + 1, view_where));
  if (view_length > size - view_offset) return Invalid(view_where + " reaches beyond the binary chunk");

  const int64_t element_bytes = components * component_bytes;
  STANCE_ASSIGN_OR_RETURN(accessor.stride_,
                          IntegerMember(*view, "byteStride", element_bytes, kLargestStride + 1, view_where));
  if (accessor.stride_ < element_bytes) {
    return Invalid(fmt::format("{}: 'byteStride' {} is less than an element's {} bytes", view_where,
                               accessor.stride_, element_bytes));
  }
  if (accessor.count_ > 0 &&
      offset + accessor.stride_ * (accessor.count_ - 1) + element_bytes > view_length) {
    return Invalid(fmt::format("{}: {} elements reach beyond {}", where, accessor.count_, view_where));
  }
  accessor.data_ = glb.binary.data() + view_offset + offset;
  return accessor;
}

bool GlbAccessor::is_unsigned_integer() const {
  return component_type_ == kUnsignedByte || component_type_ == kUnsignedShort ||
         component_type_ == kUnsignedInt;
}

const char* GlbAccessor::At(int64_t row, int component) const {
  STANCE_CHECK(row >= 0 && row < count_);
  return data_ + row * stride_ + component * ComponentBytes(component_type_);
}

float GlbAccessor::Real(int64_t row, int component) const {
  const char* const at = At(row, component);
  const auto real = [this](float value, float largest) {
    return normalized_ ? std::max(value / largest, -1.0f) : value;
  };
  switch (component_type_) {
    case kByte:
      return real(LoadLittleEndian<int8_t>(at), 127.0f);
    case kUnsignedByte:
      return real(LoadLittleEndian<uint8_t>(at), 255.0f);
    case kShort:
      return real(LoadLittleEndian<int16_t>(at), 32767.0f);
    case kUnsignedShort:
      return real(LoadLittleEndian<uint16_t>(at), 65535.0f);
    case kUnsignedInt:
      return static_cast<float>(LoadLittleEndian<uint32_t>(at));
    default:
      return LoadLittleEndian<float>(at);
  }
}

int64_t GlbAccessor::Index(int64_t row) const {
  const char* const at = At(row, 0);
  switch (component_type_) {
    case kUnsignedByte:
      return LoadLittleEndian<uint8_t>(at);
    case kUnsignedShort:
      return LoadLittleEndian<uint16_t>(at);
    default:
      STANCE_CHECK(component_type_ == kUnsignedInt);
      return LoadLittleEndian<uint32_t>(at);
  }
}

}  // namespace stance

// Polygon File Format (Turk, 1994): text and both binary byte orders, any elements, properties and types.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/mesh/io_builder.h"
#include "core/mesh/io_bytes.h"
#include "core/mesh/io_formats.h"
#include "core/mesh/io_text.h"

namespace stance {
namespace {

enum class Type { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat, kDouble };

std::optional<Type> TypeFromName(std::string_view name) {
  static constexpr std::array<std::pair<std::string_view, Type>, 16> kNames = {{{"char", Type::kInt8},
                                                                                {"int8", Type::kInt8},
                                                                                {"uchar", Type::kUint8},
                                                                                {"uint8", Type::kUint8},
                                                                                {"short", Type::kInt16},
                                                                                {"int16", Type::kInt16},
                                                                                {"ushort", Type::kUint16},
                                                                                {"uint16", Type::kUint16},
                                                                                {"int", Type::kInt32},
                                                                                {"int32", Type::kInt32},
                                                                                {"uint", Type::kUint32},
                                                                                {"uint32", Type::kUint32},
                                                                                {"float", Type::kFloat},
                                                                                {"float32", Type::kFloat},
                                                                                {"double", Type::kDouble},
                                                                                {"float64", Type::kDouble}}};
  for (const auto& [known, type] : kNames) {
    if (name == known) return type;
  }
  return std::nullopt;
}

bool IsReal(Type type) { return type == Type::kFloat || type == Type::kDouble; }

int64_t ByteSize(Type type) {
  static constexpr int64_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<int>(type)];
}

// What a property of a vertex or face is good for: a slot of the vertex, the corners, or nothing.
enum Role : int { kX, kY, kZ, kNx, kNy, kNz, kU, kV, kSlots, kCorners, kIgnored };

Role RoleFromName(std::string_view element, std::string_view name, bool is_list) {
  static constexpr std::array<std::pair<std::string_view, Role>, 12> kVertexNames = {{{"x", kX},
                                                                                      {"y", kY},
                                                                                      {"z", kZ},
                                                                                      {"nx", kNx},
                                                                                      {"ny", kNy},
                                                                                      {"nz", kNz},
                                                                                      {"s", kU},
                                                                                      {"t", kV},
                                                                                      {"u", kU},
                                                                                      {"v", kV},
                                                                                      {"texture_u", kU},
                                                                                      {"texture_v", kV}}};
  if (element == "face") {
    return is_list && (name == "vertex_indices" || name == "vertex_index") ? kCorners : kIgnored;
  }
  if (element != "vertex" || is_list) return kIgnored;
  for (const auto& [known, role] : kVertexNames) {
    if (name == known) return role;
  }
  return kIgnored;
}

struct Property {
  std::optional<Type> count_type;  // of a list
  Type type = Type::kFloat;
  Role role = kIgnored;
};

struct Element {
  std::string name;
  int64_t count = 0;
  std::vector<Property> properties;

  bool Has(Role role) const {
    return std::any_of(properties.begin(), properties.end(),
                       [&](const Property& p) { return p.role == role; });
  }
};

float ToFloat(double value) {
  constexpr double kLargest = std::numeric_limits<float>::max();
  if (std::abs(value) <= kLargest || !std::isfinite(value)) return static_cast<float>(value);
  return std::copysign(std::numeric_limits<float>::infinity(), static_cast<float>(value > 0 ? 1 : -1));
}

// The values behind the header, one after the other. Doubles hold every type of the format exactly.
class ValueReader {
 public:
  // `order` is absent for text.
  ValueReader(std::string_view bytes, std::optional<std::endian> order) : rest_(bytes), order_(order) {}

  // Nothing where the bytes end or (text) don't hold a number of that kind.
  std::optional<double> Next(Type type) {
    if (!order_) {
      const std::string_view word = NextWord(rest_);
      if (IsReal(type)) return ParseReal(word);
      return ParseInteger(word);
    }
    if (std::ssize(rest_) < ByteSize(type)) return std::nullopt;
    const char* const at = rest_.data();
    rest_.remove_prefix(ByteSize(type));
    switch (type) {
      case Type::kInt8:
        return LoadEndian<int8_t>(at, *order_);
      case Type::kUint8:
        return LoadEndian<uint8_t>(at, *order_);
      case Type::kInt16:
        return LoadEndian<int16_t>(at, *order_);
      case Type::kUint16:
        return LoadEndian<uint16_t>(at, *order_);
      case Type::kInt32:
        return LoadEndian<int32_t>(at, *order_);
      case Type::kUint32:
        return LoadEndian<uint32_t>(at, *order_);
      case Type::kFloat:
        return LoadEndian<float>(at, *order_);
      case Type::kDouble:
        return LoadEndian<double>(at, *order_);
    }
    return std::nullopt;
  }

  // Whether `count` items of the element can be there: text takes at least a digit per property.
  bool CanHold(const Element& element) const {
    int64_t least = 0;
    for (const Property& property : element.properties) {
      least += order_ ? ByteSize(property.count_type.value_or(property.type)) : 1;
    }
    return least == 0 ? element.count == 0 : element.count <= std::ssize(rest_) / least;
  }

 private:
  std::string_view rest_;
  std::optional<std::endian> order_;
};

class PlyReader {
 public:
  PlyReader(std::string_view bytes, const MeshLimits& limits) : lines_(bytes), builder_(limits) {}

  absl::StatusOr<TriangleMesh> Read() {
    STANCE_RETURN_IF_ERROR(ReadHeader());
    ValueReader values(lines_.rest(), order_);
    for (const Element& element : elements_) {
      if (!values.CanHold(element)) {
        return absl::InvalidArgumentError(
            fmt::format("PLY: the header announces {} items of element {}, more than the file holds",
                        element.count, Quoted(element.name)));
      }
      const bool is_face = element.name == "face";
      if (element.name == "vertex") STANCE_RETURN_IF_ERROR(builder_.CheckRoom(element.count, 0));
      if (is_face) STANCE_RETURN_IF_ERROR(builder_.CheckRoom(0, element.count));
      for (int64_t k = 0; k < element.count; ++k) {
        if (absl::Status status = ReadItem(element, values); !status.ok()) {
          return absl::InvalidArgumentError(fmt::format("PLY: {} {} of {}: {}", element.name, k,
                                                        element.count, std::string(status.message())));
        }
        if (!is_face) continue;
        STANCE_RETURN_IF_ERROR(builder_.CheckRoom(0, std::ssize(corners_) - 2));
        builder_.AddPolygon(corners_);
      }
    }
    return std::move(builder_).Finish(normals_, texcoords_);
  }

 private:
  absl::Status Error(const std::string& text) const {
    return absl::InvalidArgumentError(fmt::format("PLY: line {}: {}", lines_.number(), text));
  }

  absl::Status ReadHeader() {
    if (!lines_.Next() || Trimmed(lines_.line()) != "ply") return Error("the first line is not 'ply'");
    bool has_format = false;
    while (lines_.Next()) {
      std::string_view line = lines_.line();
      const std::string_view keyword = NextWord(line);
      if (keyword == "format") {
        STANCE_RETURN_IF_ERROR(ReadFormat(line));
        has_format = true;
      } else if (keyword == "element") {
        STANCE_RETURN_IF_ERROR(ReadElement(line));
      } else if (keyword == "property") {
        STANCE_RETURN_IF_ERROR(ReadProperty(line));
      } else if (keyword == "end_header") {
        if (!has_format) return Error("the header has no 'format' line");
        return CheckElements();
      } else if (!keyword.empty() && keyword != "comment" && keyword != "obj_info") {
        return Error(fmt::format("unknown header line {}", Quoted(lines_.line())));
      }
    }
    return Error("the file ends within the header");
  }

  absl::Status ReadFormat(std::string_view line) {
    const std::string_view format = NextWord(line);
    if (format == "ascii") {
      order_.reset();
    } else if (format == "binary_little_endian") {
      order_ = std::endian::little;
    } else if (format == "binary_big_endian") {
      order_ = std::endian::big;
    } else {
      return Error(fmt::format("unknown format {}", Quoted(format)));
    }
    return absl::OkStatus();
  }

  absl::Status ReadElement(std::string_view line) {
    Element element;
    element.name = CleanName(NextWord(line));
    const std::string_view word = NextWord(line);
    const std::optional<int64_t> count = ParseInteger(word);
    if (!count || *count < 0) return Error(fmt::format("{} is not a count", Quoted(word)));
    element.count = *count;
    for (const Element& other : elements_) {
      // Only these two are looked into; one of each, or their indices would mean nothing.
      if (other.name == element.name && (element.name == "vertex" || element.name == "face")) {
        return Error(fmt::format("a second element {}", Quoted(element.name)));
      }
    }
    elements_.push_back(std::move(element));
    return absl::OkStatus();
  }

  absl::Status ReadProperty(std::string_view line) {
    if (elements_.empty()) return Error("a property before the first element");
    Property property;
    const auto read_type = [&]() -> absl::StatusOr<Type> {
      const std::string_view word = NextWord(line);
      if (const std::optional<Type> type = TypeFromName(word)) return *type;
      return Error(fmt::format("unknown type {}", Quoted(word)));
    };
    std::string_view ahead = line;
    if (NextWord(ahead) == "list") {
      line = ahead;
      STANCE_ASSIGN_OR_RETURN(property.count_type, read_type());
      if (IsReal(*property.count_type)) return Error("a list's count is not of an integer type");
    }
    STANCE_ASSIGN_OR_RETURN(property.type, read_type());
    property.role = RoleFromName(elements_.back().name, NextWord(line), property.count_type.has_value());
    elements_.back().properties.push_back(property);
    return absl::OkStatus();
  }

  absl::Status CheckElements() {
    for (const Element& element : elements_) {
      if (element.name == "tristrips") return Error("triangle strips are not supported");
      if (element.name == "face" && !element.Has(kCorners)) {
        return Error("element 'face' has no list 'vertex_indices'");
      }
      if (element.name != "vertex") continue;
      has_vertices_ = true;
      if (!element.Has(kX) || !element.Has(kY) || !element.Has(kZ)) {
        return Error("element 'vertex' lacks one of the properties x, y and z");
      }
      has_normals_ = element.Has(kNx) && element.Has(kNy) && element.Has(kNz);
      has_texcoords_ = element.Has(kU) && element.Has(kV);
    }
    return has_vertices_ ? absl::OkStatus() : Error("there is no element 'vertex'");
  }

  // One vertex into the builder, one face into corners_.
  absl::Status ReadItem(const Element& element, ValueReader& values) {
    const auto incomplete = [] { return absl::InvalidArgumentError("a number is missing or malformed"); };
    std::array<float, kSlots> slots = {};
    for (const Property& property : element.properties) {
      int64_t count = 1;
      if (property.count_type) {
        const std::optional<double> value = values.Next(*property.count_type);
        if (!value) return incomplete();
        if (*value < 0 || *value > std::numeric_limits<uint32_t>::max()) {
          return absl::InvalidArgumentError(fmt::format("a list of {} numbers", *value));
        }
        count = static_cast<int64_t>(*value);
      }
      if (property.role == kCorners) corners_.clear();
      for (int64_t k = 0; k < count; ++k) {
        const std::optional<double> value = values.Next(property.type);
        if (!value) return incomplete();
        if (property.role < kSlots) slots[property.role] = ToFloat(*value);
        if (property.role != kCorners) continue;
        // Not in range, not whole, or not a number.
        if (!(std::abs(*value) <= std::numeric_limits<int32_t>::max()) || std::trunc(*value) != *value) {
          return absl::InvalidArgumentError(fmt::format("{} is not an index", *value));
        }
        corners_.push_back(static_cast<int32_t>(*value));
      }
    }
    if (element.name == "vertex") {
      builder_.AddPosition(slots[kX], slots[kY], slots[kZ]);
      if (has_normals_) normals_.insert(normals_.end(), {slots[kNx], slots[kNy], slots[kNz]});
      if (has_texcoords_) texcoords_.insert(texcoords_.end(), {slots[kU], slots[kV]});
    } else if (element.name == "face" && corners_.size() < 3) {
      return absl::InvalidArgumentError(fmt::format("a face has {} corners", corners_.size()));
    }
    return absl::OkStatus();
  }

  LineScanner lines_;
  std::optional<std::endian> order_;
  std::vector<Element> elements_;
  bool has_vertices_ = false, has_normals_ = false, has_texcoords_ = false;
  MeshBuilder builder_;
  std::vector<float> normals_, texcoords_;
  std::vector<int32_t> corners_;
};

}  // namespace

absl::StatusOr<TriangleMesh> ParsePly(std::string_view bytes, const MeshLimits& limits) {
  return PlyReader(bytes, limits).Read();
}

std::string SerializePly(const TriangleMesh& mesh) {
  const bool has_texcoords = mesh.texcoords.rows() > 0, has_normals = mesh.normals.rows() > 0;
  std::string bytes = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment Written by Stance\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n",
      mesh.vertex_count());
  if (has_normals) bytes += "property float nx\nproperty float ny\nproperty float nz\n";
  if (has_texcoords) bytes += "property float s\nproperty float t\n";
  bytes +=
      fmt::format("element face {}\nproperty list uchar int vertex_indices\nend_header\n", mesh.face_count());
  for (int64_t v = 0; v < mesh.vertex_count(); ++v) {
    for (int axis = 0; axis < 3; ++axis) AppendLittleEndian(mesh.positions(v, axis), bytes);
    for (int axis = 0; has_normals && axis < 3; ++axis) AppendLittleEndian(mesh.normals(v, axis), bytes);
    for (int axis = 0; has_texcoords && axis < 2; ++axis) AppendLittleEndian(mesh.texcoords(v, axis), bytes);
  }
  for (int64_t f = 0; f < mesh.face_count(); ++f) {
    bytes += '\3';
    for (int corner = 0; corner < 3; ++corner) AppendLittleEndian(mesh.faces(f, corner), bytes);
  }
  return bytes;
}

}  // namespace stance

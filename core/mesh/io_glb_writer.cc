// glTF 2.0 specification, https://registry.khronos.org/glTF/specs/2.0/glTF-2.0.html
#include "core/mesh/io_glb_writer.h"

#include <algorithm>
#include <nlohmann/json.hpp>

#include "core/base/check.h"
#include "core/mesh/io_bytes.h"
#include "core/mesh/io_formats.h"
#include "core/mesh/io_text.h"

namespace stance {
namespace {

using Json = nlohmann::ordered_json;

constexpr int kUnsignedByte = 5121, kUnsignedShort = 5123, kUnsignedInt = 5125, kFloat = 5126;
constexpr int32_t kRestartIndex = 0xFFFF;  // of 16 bits; glTF reserves it

void PadToFour(std::string& bytes, char padding) { bytes.resize((bytes.size() + 3) / 4 * 4, padding); }

// Appends to an array that is made when first needed: glTF allows no empty ones.
int Append(Json& root, const char* array, Json value) {
  root[array].push_back(std::move(value));
  return static_cast<int>(root[array].size()) - 1;
}

// A plain matte surface: glTF's default material is a mirror-like metal.
Json Material(const std::string& name) {
  Json material = {
      {"pbrMetallicRoughness",
       {{"baseColorFactor", {0.72, 0.74, 0.78, 1.0}}, {"metallicFactor", 0.0}, {"roughnessFactor", 0.9}}},
      {"doubleSided", true}};
  if (!name.empty()) material["name"] = CleanName(name);
  return material;
}

}  // namespace

struct GlbWriter::Document {
  Json root = {{"asset", {{"version", "2.0"}, {"generator", "Stance"}}}, {"scene", 0}};
  std::string binary;
};

GlbWriter::GlbWriter() : document_(std::make_unique<Document>()) {}
GlbWriter::~GlbWriter() = default;

int GlbWriter::AddAccessor(std::string_view data, GlbTarget target, int component_type, const char* type,
                           int64_t count) {
  Json view = {{"buffer", 0}, {"byteOffset", document_->binary.size()}, {"byteLength", data.size()}};
  if (target != GlbTarget::kOther) view["target"] = static_cast<int>(target);
  document_->binary += data;
  PadToFour(document_->binary, '\0');
  const int view_index = Append(document_->root, "bufferViews", std::move(view));
  return Append(
      document_->root, "accessors",
      {{"bufferView", view_index}, {"componentType", component_type}, {"count", count}, {"type", type}});
}

int GlbWriter::AddFloats(std::span<const float> values, int components, GlbTarget target, bool with_bounds) {
  const char* const type = components == 2   ? "VEC2"
                           : components == 3 ? "VEC3"
                           : components == 4 ? "VEC4"
                                             : "MAT4";
  STANCE_CHECK(!values.empty() && values.size() % components == 0);
  std::string data;
  data.reserve(4 * values.size());
  for (const float value : values) AppendLittleEndian(value, data);
  const int accessor = AddAccessor(data, target, kFloat, type, std::ssize(values) / components);
  if (with_bounds) {
    std::vector<float> low(values.begin(), values.begin() + components), high = low;
    for (size_t k = 0; k < values.size(); ++k) {
      low[k % components] = std::min(low[k % components], values[k]);
      high[k % components] = std::max(high[k % components], values[k]);
    }
    document_->root["accessors"][accessor]["min"] = low;
    document_->root["accessors"][accessor]["max"] = high;
  }
  return accessor;
}

int GlbWriter::AddIndices(std::span<const int32_t> indices) {
  STANCE_CHECK(!indices.empty());
  const bool is_short = *std::max_element(indices.begin(), indices.end()) < kRestartIndex;
  std::string data;
  data.reserve((is_short ? 2 : 4) * indices.size());
  for (const int32_t index : indices) {
    if (is_short) {
      AppendLittleEndian(static_cast<uint16_t>(index), data);
    } else {
      AppendLittleEndian(static_cast<uint32_t>(index), data);
    }
  }
  return AddAccessor(data, GlbTarget::kIndices, is_short ? kUnsignedShort : kUnsignedInt, "SCALAR",
                     std::ssize(indices));
}

int GlbWriter::AddBytes(std::span<const uint8_t> values) {
  STANCE_CHECK(!values.empty() && values.size() % 4 == 0);
  const std::string data(values.begin(), values.end());
  return AddAccessor(data, GlbTarget::kVertices, kUnsignedByte, "VEC4", std::ssize(values) / 4);
}

int GlbWriter::AddMesh(const TriangleMesh& mesh, const std::vector<std::pair<std::string, int>>& extra) {
  const auto flat = [](const auto& matrix) {
    return std::span<const float>(matrix.data(), static_cast<size_t>(matrix.size()));
  };
  Json attributes = {{"POSITION", AddFloats(flat(mesh.positions), 3, GlbTarget::kVertices, true)}};
  if (mesh.normals.rows() > 0) {
    Points normals = mesh.normals;
    for (int64_t v = 0; v < normals.rows(); ++v) {
      const Eigen::RowVector3f unit = normals.row(v).stableNormalized();
      normals.row(v) = unit.allFinite() && unit.norm() > 0.5f ? unit : Eigen::RowVector3f::UnitY();
    }
    attributes["NORMAL"] = AddFloats(flat(normals), 3, GlbTarget::kVertices);
  }
  if (mesh.texcoords.rows() > 0) {
    TexCoords texcoords = mesh.texcoords;
    texcoords.col(1) = 1.0f - texcoords.col(1).array();
    attributes["TEXCOORD_0"] = AddFloats(flat(texcoords), 2, GlbTarget::kVertices);
  }
  for (const auto& [semantic, accessor] : extra) attributes[semantic] = accessor;

  std::vector<MeshGroup> groups = CoveringGroups(mesh);
  if (groups.empty()) groups.push_back({"", 0, mesh.face_count()});
  Json primitives = Json::array();
  for (const MeshGroup& group : groups) {
    const std::span<const int32_t> indices(mesh.faces.data() + 3 * group.first_face,
                                           static_cast<size_t>(3 * group.face_count));
    primitives.push_back({{"attributes", attributes},
                          {"indices", AddIndices(indices)},
                          {"material", Append(document_->root, "materials", Material(group.name))}});
  }
  Json json = {{"primitives", std::move(primitives)}};
  if (groups.size() == 1 && !groups[0].name.empty()) json["name"] = CleanName(groups[0].name);
  return Append(document_->root, "meshes", std::move(json));
}

int GlbWriter::AddSkin(const std::string& name, const std::vector<int>& joint_nodes,
                       int inverse_bind_matrices) {
  return Append(document_->root, "skins",
                {{"name", CleanName(name)},
                 {"inverseBindMatrices", inverse_bind_matrices},
                 {"skeleton", joint_nodes.at(0)},
                 {"joints", joint_nodes}});
}

int GlbWriter::AddNode(const GlbNode& node) {
  Json json = Json::object();
  if (!node.name.empty()) json["name"] = CleanName(node.name);
  if (!node.translation.isZero(0)) {
    json["translation"] = {node.translation[0], node.translation[1], node.translation[2]};
  }
  if (!node.children.empty()) json["children"] = node.children;
  if (node.mesh) json["mesh"] = *node.mesh;
  if (node.skin) json["skin"] = *node.skin;
  return Append(document_->root, "nodes", std::move(json));
}

std::string GlbWriter::Finish(const std::vector<int>& scene_nodes) {
  Json& root = document_->root;
  Append(root, "scenes", {{"nodes", scene_nodes}});
  Append(root, "buffers", {{"byteLength", document_->binary.size()}});
  std::string text = root.dump();
  PadToFour(text, ' ');

  std::string bytes = "glTF";
  const size_t total = 12 + 8 + text.size() + 8 + document_->binary.size();
  bytes.reserve(total);
  AppendLittleEndian(uint32_t{2}, bytes);
  AppendLittleEndian(static_cast<uint32_t>(total), bytes);
  AppendLittleEndian(static_cast<uint32_t>(text.size()), bytes);
  bytes += "JSON";
  bytes += text;
  AppendLittleEndian(static_cast<uint32_t>(document_->binary.size()), bytes);
  bytes.append("BIN\0", 4);
  bytes += document_->binary;
  return bytes;
}

std::string SerializeGlb(const TriangleMesh& mesh) {
  GlbWriter writer;
  const int mesh_index = writer.AddMesh(mesh);
  return writer.Finish({writer.AddNode({.mesh = mesh_index})});
}

}  // namespace stance

// GLB, the binary form of glTF 2.0: the triangles of the default scene, in its frame. Skins (beyond that a
// skinned mesh ignores its node's transform), morph targets, materials and animations are ignored.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <array>
#include <limits>
#include <map>

#include "core/mesh/io_builder.h"
#include "core/mesh/io_formats.h"
#include "core/mesh/io_glb_accessor.h"
#include "core/mesh/io_text.h"

namespace stance {
namespace {

using Json = nlohmann::json;
using Eigen::Affine3d;

// Nodes may show one mesh many times, primitives share vertices, strips share corners: real files grow a few
// times. Beyond this many times their bytes (and a little for tiny files) they are made to fill the memory.
constexpr int64_t kLargestGrowth = 64;
constexpr int64_t kFreeGrowth = 1 << 20;

enum Mode { kTriangles = 4, kStrip = 5, kFan = 6, kModes = 7 };

absl::Status Invalid(const std::string& text) { return absl::InvalidArgumentError("GLB: " + text); }

std::string NameOf(const Json& json) {
  const Json* const name = FindMember(json, "name");
  return name != nullptr && name->is_string() ? CleanName(name->get_ref<const std::string&>())
                                              : std::string();
}

// An array of `count` numbers.
absl::StatusOr<std::optional<std::vector<double>>> NumbersMember(const Json& object, const char* key,
                                                                 size_t count, const std::string& where) {
  const Json* const array = FindMember(object, key);
  if (array == nullptr) return std::nullopt;
  std::vector<double> numbers;
  if (array->is_array() && array->size() == count) {
    for (const Json& number : *array) {
      if (number.is_number()) numbers.push_back(number.get<double>());
    }
  }
  if (numbers.size() != count) return Invalid(fmt::format("{}: '{}' is not {} numbers", where, key, count));
  return numbers;
}

// The corners of triangle t of a primitive whose corners are in sequence (glTF 2.0, 3.7.2.1).
std::array<int64_t, 3> TriangleCorners(Mode mode, int64_t t) {
  switch (mode) {
    case kStrip:
      return {t, t + 1 + t % 2, t + 2 - t % 2};
    case kFan:
      return {t + 1, t + 2, 0};
    default:
      return {3 * t, 3 * t + 1, 3 * t + 2};
  }
}

class GlbReader {
 public:
  GlbReader(GlbChunks glb, int64_t file_size, const MeshLimits& limits)
      : glb_(std::move(glb)), budget_(kFreeGrowth + kLargestGrowth * file_size), builder_(limits) {}

  absl::StatusOr<TriangleMesh> Read() {
    STANCE_RETURN_IF_ERROR(RefuseCompression());
    STANCE_RETURN_IF_ERROR(ReadScene());
    if (builder_.face_count() == 0) return Invalid("there are no triangles in its scene");
    if (!has_normals_) normals_.clear();
    if (!has_texcoords_) texcoords_.clear();
    TriangleMesh mesh = std::move(builder_).Finish(normals_, texcoords_);
    if (mesh.groups.size() == 1 && mesh.groups[0].name.empty()) mesh.groups.clear();
    return mesh;
  }

 private:
  absl::Status RefuseCompression() const {
    const Json* const required = FindMember(glb_.root, "extensionsRequired");
    if (required == nullptr || !required->is_array()) return absl::OkStatus();
    for (const Json& extension : *required) {
      if (extension == "KHR_draco_mesh_compression") return Invalid("Draco compression is not supported");
      if (extension == "EXT_meshopt_compression") return Invalid("meshopt compression is not supported");
    }
    return absl::OkStatus();
  }

  // The nodes that the walk begins with: the default scene's, or else those without a parent.
  absl::StatusOr<std::vector<int64_t>> RootNodes() const {
    const int64_t count = ItemCount(glb_, "nodes");
    std::vector<int64_t> roots;
    if (ItemCount(glb_, "scenes") > 0) {
      STANCE_ASSIGN_OR_RETURN(const int64_t scene,
                              IntegerMember(glb_.root, "scene", 0, ItemCount(glb_, "scenes"), "the file"));
      STANCE_ASSIGN_OR_RETURN(const Json* const json, Item(glb_, "scenes", scene));
      STANCE_RETURN_IF_ERROR(AppendNodes(*json, "nodes", roots));
      return roots;
    }
    std::vector<int64_t> children;
    for (int64_t n = 0; n < count; ++n) {
      STANCE_ASSIGN_OR_RETURN(const Json* const json, Item(glb_, "nodes", n));
      STANCE_RETURN_IF_ERROR(AppendNodes(*json, "children", children));
    }
    std::vector<bool> has_parent(count, false);
    for (const int64_t n : children) has_parent[n] = true;
    for (int64_t n = 0; n < count; ++n) {
      if (!has_parent[n]) roots.push_back(n);
    }
    return roots;
  }

  absl::Status AppendNodes(const Json& object, const char* key, std::vector<int64_t>& nodes) const {
    const Json* const array = FindMember(object, key);
    if (array == nullptr) return absl::OkStatus();
    if (!array->is_array()) return Invalid(fmt::format("'{}' is not an array", key));
    for (const Json& node : *array) {
      if (!node.is_number_unsigned() ||
          node.get<uint64_t>() >= static_cast<uint64_t>(ItemCount(glb_, "nodes"))) {
        return Invalid(fmt::format("'{}' names a node that does not exist", key));
      }
      nodes.push_back(node.get<int64_t>());
    }
    return absl::OkStatus();
  }

  // Walks the tree in the order in which it is written; each node is met at most once.
  absl::Status ReadScene() {
    struct Visit {
      int64_t node;
      Affine3d parent;
    };
    STANCE_ASSIGN_OR_RETURN(std::vector<int64_t> next, RootNodes());
    std::vector<Visit> stack;
    const auto push = [&](const Affine3d& parent) {
      for (auto n = next.rbegin(); n != next.rend(); ++n) stack.push_back({*n, parent});
    };
    push(Affine3d::Identity());
    std::vector<bool> met(ItemCount(glb_, "nodes"), false);
    while (!stack.empty()) {
      const Visit visit = stack.back();
      stack.pop_back();
      if (met[visit.node])
        return Invalid(fmt::format("nodes[{}] has two parents or contains itself", visit.node));
      met[visit.node] = true;
      STANCE_ASSIGN_OR_RETURN(const Json* const json, Item(glb_, "nodes", visit.node));
      STANCE_ASSIGN_OR_RETURN(const Affine3d local,
                              LocalTransform(*json, fmt::format("nodes[{}]", visit.node)));
      const Affine3d global = visit.parent * local;
      if (FindMember(*json, "mesh") != nullptr) {
        // Joints place a skinned mesh, not its node (glTF 2.0, 3.7.3); the pose that it is stored in is ours.
        const bool skinned = FindMember(*json, "skin") != nullptr;
        STANCE_RETURN_IF_ERROR(ReadMeshOf(*json, visit.node, skinned ? Affine3d::Identity() : global));
      }
      next.clear();
      STANCE_RETURN_IF_ERROR(AppendNodes(*json, "children", next));
      push(global);
    }
    return absl::OkStatus();
  }

  static absl::StatusOr<Affine3d> LocalTransform(const Json& node, const std::string& where) {
    Affine3d transform = Affine3d::Identity();
    STANCE_ASSIGN_OR_RETURN(const auto matrix, NumbersMember(node, "matrix", 16, where));
    if (matrix) {
      transform.matrix().topRows<3>() = Eigen::Map<const Eigen::Matrix4d>(matrix->data()).topRows<3>();
      return transform;
    }
    STANCE_ASSIGN_OR_RETURN(const auto translation, NumbersMember(node, "translation", 3, where));
    STANCE_ASSIGN_OR_RETURN(const auto rotation, NumbersMember(node, "rotation", 4, where));
    STANCE_ASSIGN_OR_RETURN(const auto scale, NumbersMember(node, "scale", 3, where));
    if (translation) transform.translate(Eigen::Map<const Eigen::Vector3d>(translation->data()));
    if (rotation) {
      const std::vector<double>& q = *rotation;  // x, y, z, w
      transform.rotate(Eigen::Quaterniond(q[3], q[0], q[1], q[2]).normalized());
    }
    if (scale) transform.scale(Eigen::Map<const Eigen::Vector3d>(scale->data()));
    return transform;
  }

  absl::Status ReadMeshOf(const Json& node, int64_t node_index, const Affine3d& transform) {
    STANCE_ASSIGN_OR_RETURN(const int64_t index, IntegerMember(node, "mesh", 0, ItemCount(glb_, "meshes"),
                                                               fmt::format("nodes[{}]", node_index)));
    STANCE_ASSIGN_OR_RETURN(const Json* const mesh, Item(glb_, "meshes", index));
    const Json* const primitives = FindMember(*mesh, "primitives");
    if (primitives == nullptr || !primitives->is_array()) {
      return Invalid(fmt::format("meshes[{}] has no primitives", index));
    }
    const std::string mesh_name = NameOf(*mesh).empty() ? NameOf(node) : NameOf(*mesh);
    first_vertex_of_.clear();
    for (size_t p = 0; p < primitives->size(); ++p) {
      const Json& primitive = (*primitives)[p];
      const std::string where = fmt::format("meshes[{}].primitives[{}]", index, p);
      std::string name = MaterialName(primitive);
      if (primitives->size() == 1 && !mesh_name.empty()) name = mesh_name;
      if (primitives->size() > 1 && name.empty() && !mesh_name.empty())
        name = fmt::format("{} {}", mesh_name, p);
      builder_.BeginGroup(std::move(name));
      STANCE_RETURN_IF_ERROR(ReadPrimitive(primitive, transform, where));
    }
    return absl::OkStatus();
  }

  std::string MaterialName(const Json& primitive) const {
    const Json* const index = FindMember(primitive, "material");
    if (index == nullptr || !index->is_number_unsigned() ||
        index->get<uint64_t>() >= static_cast<uint64_t>(ItemCount(glb_, "materials"))) {
      return "";
    }
    return NameOf(glb_.root.find("materials")->at(index->get<size_t>()));
  }

  absl::Status ReadPrimitive(const Json& primitive, const Affine3d& transform, const std::string& where) {
    STANCE_ASSIGN_OR_RETURN(const int64_t mode, IntegerMember(primitive, "mode", kTriangles, kModes, where));
    if (mode < kTriangles) return absl::OkStatus();  // points and lines
    if (const Json* const extensions = FindMember(primitive, "extensions");
        extensions != nullptr && FindMember(*extensions, "KHR_draco_mesh_compression") != nullptr) {
      return Invalid(where + ": Draco compression is not supported");
    }
    const Json* const attributes = FindMember(primitive, "attributes");
    if (attributes == nullptr || FindMember(*attributes, "POSITION") == nullptr) {
      return Invalid(where + " has no attribute 'POSITION'");
    }
    int64_t vertices = 0;
    STANCE_ASSIGN_OR_RETURN(const int64_t first, AddVertices(*attributes, transform, where, vertices));

    std::optional<GlbAccessor> indices;
    if (FindMember(primitive, "indices") != nullptr) {
      STANCE_ASSIGN_OR_RETURN(const int64_t accessor,
                              IntegerMember(primitive, "indices", 0, ItemCount(glb_, "accessors"), where));
      STANCE_ASSIGN_OR_RETURN(indices, GlbAccessor::Find(glb_, accessor, "SCALAR"));
      if (!indices->is_unsigned_integer()) return Invalid(where + ": the indices are not unsigned integers");
    }
    const int64_t corners = indices ? indices->count() : vertices;
    if (mode == kTriangles && corners % 3 != 0) {
      return Invalid(fmt::format("{}: {} corners are no whole number of triangles", where, corners));
    }
    const int64_t triangles = mode == kTriangles ? corners / 3 : std::max<int64_t>(corners - 2, 0);
    STANCE_RETURN_IF_ERROR(builder_.CheckRoom(0, triangles));
    STANCE_RETURN_IF_ERROR(Spend(triangles * 12, where));
    const bool mirrored = transform.linear().determinant() < 0;  // turns the winding over (glTF 2.0, 3.7.4)
    for (int64_t t = 0; t < triangles; ++t) {
      std::array<int32_t, 3> face;
      const std::array<int64_t, 3> at = TriangleCorners(static_cast<Mode>(mode), t);
      for (int corner = 0; corner < 3; ++corner) {
        const int64_t index = indices ? indices->Index(at[corner]) : at[corner];
        if (index >= vertices) {
          return Invalid(
              fmt::format("{}: triangle {} names vertex {}, but there are {}", where, t, index, vertices));
        }
        face[corner] = static_cast<int32_t>(first + index);
      }
      if (mirrored) std::swap(face[1], face[2]);
      builder_.AddPolygon(face);
    }
    return absl::OkStatus();
  }

  // Adds the vertices of a primitive, unless an earlier primitive of the same mesh had the same; returns the
  // first one's index, and their number.
  absl::StatusOr<int64_t> AddVertices(const Json& attributes, const Affine3d& transform,
                                      const std::string& where, int64_t& vertices) {
    constexpr std::array<const char*, 3> kSemantics = {"POSITION", "NORMAL", "TEXCOORD_0"};
    constexpr std::array<const char*, 3> kTypes = {"VEC3", "VEC3", "VEC2"};
    std::array<int64_t, 3> key;
    std::array<std::optional<GlbAccessor>, 3> accessors;
    for (int k = 0; k < 3; ++k) {
      STANCE_ASSIGN_OR_RETURN(
          key[k], IntegerMember(attributes, kSemantics[k], -1, ItemCount(glb_, "accessors"), where));
      if (key[k] < 0) continue;
      STANCE_ASSIGN_OR_RETURN(accessors[k], GlbAccessor::Find(glb_, key[k], kTypes[k]));
      if (accessors[k]->count() != accessors[0]->count()) {
        return Invalid(fmt::format("{}: {} {} values for {} vertices", where, accessors[k]->count(),
                                   kSemantics[k], accessors[0]->count()));
      }
    }
    const auto& [positions, normals, texcoords] = accessors;
    vertices = positions->count();
    const auto [place, added] = first_vertex_of_.try_emplace(key, builder_.vertex_count());
    if (!added) return place->second;
    STANCE_RETURN_IF_ERROR(builder_.CheckRoom(vertices, 0));
    STANCE_RETURN_IF_ERROR(Spend(vertices * (12 + (normals ? 12 : 0) + (texcoords ? 8 : 0)), where));
    if (builder_.vertex_count() + vertices > std::numeric_limits<int32_t>::max()) {
      return Invalid("more vertices than 32-bit indices can name");
    }

    // A normal is a plane's: it turns with the inverse transpose, here up to a factor that normalising
    // removes.
    Eigen::Matrix3d cofactors;
    const Eigen::Matrix3d& linear = transform.linear();
    for (int k = 0; k < 3; ++k) cofactors.col(k) = linear.col((k + 1) % 3).cross(linear.col((k + 2) % 3));
    if (linear.determinant() < 0) cofactors = -cofactors;
    const bool identity = transform.matrix().isIdentity(0);
    has_normals_ = has_normals_ && normals.has_value();
    has_texcoords_ = has_texcoords_ && texcoords.has_value();
    for (int64_t v = 0; v < vertices; ++v) {
      const auto vector = [v](const GlbAccessor& accessor) {
        return Eigen::Vector3f(accessor.Real(v, 0), accessor.Real(v, 1), accessor.Real(v, 2));
      };
      Eigen::Vector3f position = vector(*positions);
      if (!identity) position = (transform * position.cast<double>()).cast<float>();
      builder_.AddPosition(position[0], position[1], position[2]);
      if (has_normals_) {
        Eigen::Vector3f normal = vector(*normals);
        if (!identity) normal = (cofactors * normal.cast<double>()).stableNormalized().cast<float>();
        normals_.insert(normals_.end(), normal.data(), normal.data() + 3);
      }
      if (has_texcoords_) {  // glTF's origin is at the upper left
        texcoords_.insert(texcoords_.end(), {texcoords->Real(v, 0), 1.0f - texcoords->Real(v, 1)});
      }
    }
    return place->second;
  }

  absl::Status Spend(int64_t bytes, const std::string& where) {
    budget_ -= bytes;
    if (budget_ >= 0) return absl::OkStatus();
    return Invalid(
        fmt::format("{}: the scene is more than {} times as large as the file", where, kLargestGrowth));
  }

  GlbChunks glb_;
  int64_t budget_;  // bytes of mesh that may still be made
  MeshBuilder builder_;
  std::vector<float> normals_, texcoords_;
  bool has_normals_ = true, has_texcoords_ = true;             // of all primitives so far
  std::map<std::array<int64_t, 3>, int64_t> first_vertex_of_;  // by accessors, of the current mesh
};

}  // namespace

absl::StatusOr<TriangleMesh> ParseGlb(std::string_view bytes, const MeshLimits& limits) {
  STANCE_ASSIGN_OR_RETURN(GlbChunks chunks, SplitGlb(bytes));
  return GlbReader(std::move(chunks), std::ssize(bytes), limits).Read();
}

}  // namespace stance

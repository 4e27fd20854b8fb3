#include "core/training/rigged_mesh.h"

#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <fmt/format.h>

#include <assimp/Importer.hpp>
#include <map>
#include <string_view>
#include <utility>

#include "core/mesh/weld.h"

namespace stance {
namespace {

using Matrix = Eigen::Matrix4f;
using Triangle = Eigen::RowVector3i;

Matrix ToEigen(const aiMatrix4x4& matrix) {
  Matrix result;
  for (int r = 0; r < 4; ++r) {
    for (int c = 0; c < 4; ++c) result(r, c) = matrix[r][c];
  }
  return result;
}

// The scene's unit in metres: FBX files say theirs in centimetres, glTF's is the metre.
float UnitOf(const aiScene& scene) {
  double wide = 0;
  float narrow = 0;
  if (scene.mMetaData == nullptr) return 1;
  if (scene.mMetaData->Get("UnitScaleFactor", wide)) return static_cast<float>(0.01 * wide);
  return scene.mMetaData->Get("UnitScaleFactor", narrow) ? 0.01f * narrow : 1;
}

// assimp names the nodes that stand for FBX's geometric transform so. That moves a node's vertices, but the
// binding of its bones knows nothing of it.
constexpr std::string_view kGeometricNode = "_$AssimpFbx$_Geometric";

// A mesh of the scene, and where its node puts its vertices and its bones.
struct Part {
  const aiMesh* mesh;
  Matrix transform;
  Matrix bone_transform;
};

struct Influence {
  int64_t vertex;
  int bone;
  float weight;
};

// Gathers the scene's skinned parts.
class Collector {
 public:
  explicit Collector(const aiScene& scene) : scene_(scene), unit_(UnitOf(scene)) {
    FindParts(*scene.mRootNode, Matrix::Identity(), Matrix::Identity());
    AddBones(*scene.mRootNode, -1);
    for (const Part& part : parts_) AddPart(part);
  }

  RiggedMesh Welded() const {
    TriangleMesh mesh;
    mesh.positions =
        Eigen::Map<const Points>(positions_.data(), static_cast<Eigen::Index>(positions_.size() / 3), 3);
    mesh.faces = Eigen::Map<const Faces>(corners_.data(), static_cast<Eigen::Index>(corners_.size() / 3), 3);
    const WeldedMesh welded = WeldVertices(mesh);
    RiggedMesh result;
    result.positions = welded.mesh.positions;
    result.bones = bones_;
    result.weights = RowMatrix::Zero(result.positions.rows(), static_cast<Eigen::Index>(bones_.size()));
    for (const Influence& i : influences_) result.weights(welded.welded_row[i.vertex], i.bone) += i.weight;
    for (Eigen::Index v = 0; v < result.weights.rows(); ++v) {
      const float sum = result.weights.row(v).sum();
      if (sum > 0) result.weights.row(v) /= sum;
    }
    result.faces.resize(welded.mesh.faces.rows(), 3);
    Eigen::Index kept = 0;
    for (Eigen::Index f = 0; f < welded.mesh.faces.rows(); ++f) {
      const Triangle face = welded.mesh.faces.row(f);
      if (face[0] != face[1] && face[1] != face[2] && face[2] != face[0]) result.faces.row(kept++) = face;
    }
    result.faces.conservativeResize(kept, 3);
    return result;
  }

 private:
  void FindParts(const aiNode& node, Matrix transform, Matrix bone_transform) {
    const Matrix own = ToEigen(node.mTransformation);
    const bool geometric =
        std::string_view(node.mName.C_Str()).find(kGeometricNode) != std::string_view::npos;
    transform *= own;
    if (!geometric) bone_transform *= own;
    for (unsigned i = 0; i < node.mNumMeshes; ++i) {
      const aiMesh& mesh = *scene_.mMeshes[node.mMeshes[i]];
      if (mesh.HasBones() && mesh.HasFaces()) parts_.push_back({&mesh, transform, bone_transform});
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) FindParts(*node.mChildren[i], transform, bone_transform);
  }

  // Where the bone of that name begins, if a part is bound to it.
  const Part* PartOf(const std::string& name, Eigen::Vector3f& head) const {
    for (const Part& part : parts_) {
      for (unsigned b = 0; b < part.mesh->mNumBones; ++b) {
        const aiBone& bone = *part.mesh->mBones[b];
        if (name != bone.mName.C_Str()) continue;
        aiMatrix4x4 bind = bone.mOffsetMatrix;
        bind.Inverse();
        head = unit_ * (part.bone_transform * ToEigen(bind)).topRightCorner<3, 1>();
        return &part;
      }
    }
    return nullptr;
  }

  void AddBones(const aiNode& node, int parent) {
    FileBone bone{node.mName.C_Str(), parent};
    if (PartOf(bone.name, bone.head) != nullptr && !row_of_bone_.contains(bone.name)) {
      parent = static_cast<int>(bones_.size());
      row_of_bone_[bone.name] = parent;
      bones_.push_back(std::move(bone));
    }
    for (unsigned i = 0; i < node.mNumChildren; ++i) AddBones(*node.mChildren[i], parent);
  }

  void AddPart(const Part& part) {
    const auto first = static_cast<int64_t>(positions_.size() / 3);
    for (unsigned v = 0; v < part.mesh->mNumVertices; ++v) {
      const aiVector3D& p = part.mesh->mVertices[v];
      const Eigen::Vector4f moved = part.transform * Eigen::Vector4f(p.x, p.y, p.z, 1);
      for (int c = 0; c < 3; ++c) positions_.push_back(unit_ * moved[c]);
    }
    for (unsigned f = 0; f < part.mesh->mNumFaces; ++f) {
      const aiFace& face = part.mesh->mFaces[f];
      if (face.mNumIndices != 3) continue;  // points and lines
      for (int c = 0; c < 3; ++c) corners_.push_back(static_cast<int32_t>(first + face.mIndices[c]));
    }
    for (unsigned b = 0; b < part.mesh->mNumBones; ++b) {
      const aiBone& bone = *part.mesh->mBones[b];
      const auto row = row_of_bone_.find(bone.mName.C_Str());
      if (row == row_of_bone_.end()) continue;
      for (unsigned i = 0; i < bone.mNumWeights; ++i) {
        const aiVertexWeight& weight = bone.mWeights[i];
        if (weight.mWeight > 0)
          influences_.push_back({first + weight.mVertexId, row->second, weight.mWeight});
      }
    }
  }

  const aiScene& scene_;
  const float unit_;
  std::vector<Part> parts_;
  std::vector<FileBone> bones_;
  std::map<std::string, int> row_of_bone_;
  std::vector<float> positions_;
  std::vector<int32_t> corners_;
  std::vector<Influence> influences_;
};

}  // namespace

absl::StatusOr<RiggedMesh> ReadRiggedMesh(const std::filesystem::path& path) {
  if (!std::filesystem::exists(path))
    return absl::NotFoundError(fmt::format("{}: no such file", path.string()));
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(path.string(), aiProcess_Triangulate);
  if (scene == nullptr || scene->mRootNode == nullptr) {
    return absl::InvalidArgumentError(fmt::format("{}: {}", path.string(), importer.GetErrorString()));
  }
  RiggedMesh mesh = Collector(*scene).Welded();
  if (mesh.bones.empty() || mesh.faces.rows() == 0) {
    return absl::InvalidArgumentError(fmt::format("{}: no mesh is bound to bones", path.string()));
  }
  if (!mesh.positions.allFinite()) {
    return absl::InvalidArgumentError(fmt::format("{}: a coordinate is not finite", path.string()));
  }
  return mesh;
}

}  // namespace stance

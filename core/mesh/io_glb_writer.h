// Puts a GLB (binary glTF 2.0) together: what mesh files and rigged characters share.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "core/mesh/triangle_mesh.h"

namespace stance {

// What a buffer view is for, as glTF wants it said.
enum class GlbTarget { kOther = 0, kVertices = 34962, kIndices = 34963 };

struct GlbNode {
  std::string name = {};
  Eigen::Vector3f translation = Eigen::Vector3f::Zero();
  std::vector<int> children = {};
  std::optional<int> mesh = {}, skin = {};
};

// Every Add returns the index that the rest of the file names the thing by.
class GlbWriter {
 public:
  GlbWriter();
  ~GlbWriter();
  GlbWriter(const GlbWriter&) = delete;
  GlbWriter& operator=(const GlbWriter&) = delete;

  // Accessors. `components` is 2, 3, 4 or 16 (a column-major 4 x 4 matrix) floats per element; with_bounds
  // adds the minimum and maximum that positions must have.
  int AddFloats(std::span<const float> values, int components, GlbTarget target, bool with_bounds = false);
  int AddIndices(std::span<const int32_t> indices);  // 16 bits where they suffice
  int AddBytes(std::span<const uint8_t> values);     // four per element, for vertices

  // The mesh as one primitive and material per group over shared vertices; `extra` are more vertex attributes
  // as (semantic, accessor). Normals of no length become +y, texture coordinates get glTF's origin (upper
  // left). REQUIRES: what io_formats.h asks for, and at least one face.
  int AddMesh(const TriangleMesh& mesh, const std::vector<std::pair<std::string, int>>& extra = {});
  int AddSkin(const std::string& name, const std::vector<int>& joint_nodes, int inverse_bind_matrices);
  int AddNode(const GlbNode& node);

  // The file, with these nodes as its scene. Call once, last.
  std::string Finish(const std::vector<int>& scene_nodes);

 private:
  struct Document;
  int AddAccessor(std::string_view data, GlbTarget target, int component_type, const char* type,
                  int64_t count);

  std::unique_ptr<Document> document_;
};

}  // namespace stance

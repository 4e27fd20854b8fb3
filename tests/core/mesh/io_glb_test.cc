#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/mesh/io_bytes.h"
#include "core/mesh/io_formats.h"
#include "core/mesh/io_glb_accessor.h"
#include "core/mesh/mesh_io.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

using ::testing::HasSubstr;
using Json = nlohmann::json;

std::string Glb(const std::string& json, const std::string& binary) {
  std::string bytes = "glTF", text = json, data = binary;
  text.resize((text.size() + 3) / 4 * 4, ' ');
  data.resize((data.size() + 3) / 4 * 4, '\0');
  for (const size_t word : {size_t{2}, 12 + 8 + text.size() + 8 + data.size(), text.size()}) {
    AppendLittleEndian(static_cast<uint32_t>(word), bytes);
  }
  bytes += "JSON" + text;
  AppendLittleEndian(static_cast<uint32_t>(data.size()), bytes);
  return bytes.append("BIN\0", 4) + data;
}

template <typename T>
std::string Packed(const std::vector<T>& values) {
  std::string bytes;
  for (const T value : values) AppendLittleEndian(value, bytes);
  return bytes;
}

// A square of four vertices (48 bytes) and its two triangles as 16-bit indices (12 bytes).
std::string SquareBinary() {
  return Packed<float>({0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}) + Packed<uint16_t>({0, 1, 2, 0, 2, 3});
}

Json SquareDocument() {
  return Json::parse(R"({
    "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
    "meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
    "accessors": [
      {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3", "min": [0, 0, 0], "max": [1, 1, 0]},
      {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}],
    "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
    "buffers": [{"byteLength": 60}]})");
}

TriangleMesh Parse(const Json& document, const std::string& binary = SquareBinary()) {
  absl::StatusOr<TriangleMesh> mesh = ParseGlb(Glb(document.dump(), binary));
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : TriangleMesh{};
}

std::string RejectionOfBytes(const std::string& bytes) {
  const absl::StatusOr<TriangleMesh> mesh = ParseGlb(bytes);
  EXPECT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument);
  return std::string(mesh.status().message());
}

std::string RejectionOf(const Json& document, const std::string& binary = SquareBinary()) {
  return RejectionOfBytes(Glb(document.dump(), binary));
}

// The square's document with the value at the JSON pointer replaced (or added).
Json With(const char* pointer, Json value) {
  Json document = SquareDocument();
  document[Json::json_pointer(pointer)] = std::move(value);
  return document;
}

Points SquarePoints() { return (Points(4, 3) << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0).finished(); }
Faces SquareFaces() { return (Faces(2, 3) << 0, 1, 2, 0, 2, 3).finished(); }

TEST(ParseGlb, ReadsASquare) {
  const TriangleMesh mesh = Parse(SquareDocument());
  EXPECT_EQ(mesh.positions, SquarePoints());
  EXPECT_EQ(mesh.faces, SquareFaces());
  EXPECT_TRUE(mesh.groups.empty());
}

TEST(ParseGlb, ReadsIndicesOfEveryWidth) {
  const std::string positions = SquareBinary().substr(0, 48);
  for (const auto& [type, size, data] : {std::tuple(5121, 1, Packed<uint8_t>({0, 1, 2, 0, 2, 3})),
                                         std::tuple(5123, 2, Packed<uint16_t>({0, 1, 2, 0, 2, 3})),
                                         std::tuple(5125, 4, Packed<uint32_t>({0, 1, 2, 0, 2, 3}))}) {
    Json document = With("/accessors/1/componentType", type);
    document["bufferViews"][1]["byteLength"] = 6 * size;
    EXPECT_EQ(Parse(document, positions + data).faces, SquareFaces());
  }
}

TEST(ParseGlb, ReadsStripsFansAndPlainTriangles) {
  Json document = SquareDocument();
  document["meshes"][0]["primitives"][0].erase("indices");
  document["meshes"][0]["primitives"][0]["mode"] = 5;
  EXPECT_EQ(Parse(document).faces, (Faces(2, 3) << 0, 1, 2, 1, 3, 2).finished());
  document["meshes"][0]["primitives"][0]["mode"] = 6;
  EXPECT_EQ(Parse(document).faces, (Faces(2, 3) << 1, 2, 0, 2, 3, 0).finished());
  document["meshes"][0]["primitives"][0]["mode"] = 4;
  EXPECT_THAT(RejectionOf(document), HasSubstr("4 corners are no whole number of triangles"));
  document["accessors"][0]["count"] = 3;
  EXPECT_EQ(Parse(document).faces, (Faces(1, 3) << 0, 1, 2).finished());
}

TEST(ParseGlb, ReadsInterleavedAndQuantisedAttributes) {
  // Per vertex: position as four normalised bytes (one of them padding), texture coordinate as two 16-bit.
  std::string binary;
  for (const auto& [x, y] : {std::pair(0, 0), {127, 0}, {127, 127}, {0, -128}}) {
    binary += Packed<int8_t>({static_cast<int8_t>(x), static_cast<int8_t>(y), 0, 99});
    binary += Packed<uint16_t>({static_cast<uint16_t>(x == 127 ? 65535 : 0), 0});
  }
  binary += Packed<uint16_t>({0, 1, 2, 0, 2, 3});
  Json document = SquareDocument();
  document["bufferViews"] = {{{"buffer", 0}, {"byteLength", 32}, {"byteStride", 8}},
                             {{"buffer", 0}, {"byteOffset", 32}, {"byteLength", 12}}};
  document["accessors"][0] = {
      {"bufferView", 0}, {"componentType", 5120}, {"normalized", true}, {"count", 4}, {"type", "VEC3"}};
  document["accessors"][2] = {{"bufferView", 0},    {"byteOffset", 4}, {"componentType", 5123},
                              {"normalized", true}, {"count", 4},      {"type", "VEC2"}};
  document["meshes"][0]["primitives"][0]["attributes"]["TEXCOORD_0"] = 2;
  const TriangleMesh mesh = Parse(document, binary);
  EXPECT_EQ(mesh.positions, (Points(4, 3) << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, -1, 0).finished());
  EXPECT_EQ(mesh.texcoords, (TexCoords(4, 2) << 0, 1, 1, 1, 1, 1, 0, 1).finished());
}

TEST(ParseGlb, AppliesTheTransformsOfTheNodesAbove) {
  Json document = SquareDocument();
  const double h = std::sqrt(0.5);
  document["nodes"] = {{{"children", {1}}, {"translation", {10, 0, 0}}},
                       {{"children", {2}}, {"rotation", {0, 0, h, h}}},  // a quarter turn about z
                       {{"mesh", 0}, {"scale", {2, 3, 4}}}};
  const Points expected = (Points(4, 3) << 10, 0, 0, 10, 2, 0, 7, 2, 0, 7, 0, 0).finished();
  EXPECT_LT((Parse(document).positions - expected).cwiseAbs().maxCoeff(), 1e-5f);

  document["nodes"] = {{{"mesh", 0}, {"matrix", {0, 2, 0, 0, -3, 0, 0, 0, 0, 0, 4, 0, 10, 0, 0, 1}}}};
  EXPECT_LT((Parse(document).positions - expected).cwiseAbs().maxCoeff(), 1e-5f);
}

// glTF 2.0, 3.7.3: joints place a skinned mesh, its own node and those above it do not.
TEST(ParseGlb, IgnoresTheTransformOfASkinnedMeshesNode) {
  Json document = SquareDocument();
  document["nodes"] = {{{"children", {1}}, {"translation", {10, 0, 0}}},
                       {{"mesh", 0}, {"skin", 0}, {"scale", {2, 3, 4}}}};
  document["skins"] = {{{"joints", {0}}}};
  EXPECT_EQ(Parse(document).positions, SquarePoints());
}

TEST(ParseGlb, AMirroringNodeKeepsNormalsOnTheFacesOuterSide) {
  const TriangleMesh sphere = testing::WithAttributes(testing::Icosphere(2));
  const std::string bytes = SerializeGlb(sphere);
  const GlbChunks chunks = SplitGlb(bytes).value();
  Json document = chunks.root;
  for (const std::vector<double>& scale :
       {std::vector<double>{-1, 2, 1}, {1, 1, 3}, {-1, -1, -1}, {-1, -1, 0.5}}) {
    document["nodes"][0]["scale"] = scale;
    const TriangleMesh mesh = Parse(document, std::string(chunks.binary));
    ASSERT_EQ(mesh.normals.rows(), mesh.vertex_count());
    for (int64_t f = 0; f < mesh.face_count(); ++f) {
      const Eigen::RowVector3f a = mesh.positions.row(mesh.faces(f, 0)),
                               b = mesh.positions.row(mesh.faces(f, 1)),
                               c = mesh.positions.row(mesh.faces(f, 2));
      const Eigen::RowVector3f face_normal = (b - a).cross(c - a).normalized();
      EXPECT_GT(face_normal.dot(a), 0) << "inside out";
      for (int k = 0; k < 3; ++k) EXPECT_GT(face_normal.dot(mesh.normals.row(mesh.faces(f, k))), 0.8f);
    }
  }
}

TEST(ParseGlb, ConcatenatesPrimitivesAsGroupsAndSharesTheirVertices) {
  Json document = SquareDocument();
  document["materials"] = {{{"name", "skin"}}, Json::object()};
  document["accessors"][2] = {{"bufferView", 1}, {"componentType", 5123}, {"count", 3}, {"type", "SCALAR"}};
  document["accessors"][3] = document["accessors"][0];
  Json& mesh_json = document["meshes"][0];
  mesh_json["name"] = "body";
  mesh_json["primitives"] = {{{"attributes", {{"POSITION", 0}}}, {"indices", 1}, {"material", 0}},
                             {{"attributes", {{"POSITION", 0}}}, {"indices", 2}, {"material", 1}},
                             {{"attributes", {{"POSITION", 3}}}, {"indices", 2}}};
  const TriangleMesh mesh = Parse(document);
  EXPECT_EQ(mesh.vertex_count(), 8) << "the first two primitives share four vertices";
  EXPECT_EQ(mesh.faces.row(2), Eigen::RowVector3i(0, 1, 2));
  EXPECT_EQ(mesh.faces.row(3), Eigen::RowVector3i(4, 5, 6));
  ASSERT_EQ(mesh.groups.size(), 3u);
  EXPECT_EQ(mesh.groups[0].name, "skin");
  EXPECT_EQ(mesh.groups[1].name, "body 1");
  EXPECT_EQ(mesh.groups[2].name, "body 2");
  EXPECT_EQ(mesh.groups[2].first_face, 3);
}

TEST(ParseGlb, ReadsOnlyTheDefaultScene) {
  Json document = SquareDocument();
  document["nodes"] = {{{"mesh", 0}}, {{"mesh", 0}, {"translation", {0, 0, 5}}}, {{"camera", 0}}};
  document["scenes"] = {{{"nodes", {0}}}, {{"nodes", {2, 1}}}};
  document["scene"] = 1;
  EXPECT_EQ(Parse(document).positions(0, 2), 5.0f);
  document.erase("scene");
  EXPECT_EQ(Parse(document).positions(0, 2), 0.0f);
  document.erase("scenes");  // all nodes without a parent
  EXPECT_EQ(Parse(document).vertex_count(), 8);
}

TEST(ParseGlb, AttributesThatAPrimitiveLacksAreDropped) {
  Json document = SquareDocument();
  document["accessors"][2] = document["accessors"][0];
  document["meshes"][0]["primitives"][1] = document["meshes"][0]["primitives"][0];
  document["meshes"][0]["primitives"][0]["attributes"]["NORMAL"] = 2;
  EXPECT_EQ(Parse(document).normals.rows(), 0);
  document["meshes"][0]["primitives"][1]["attributes"]["NORMAL"] = 2;
  EXPECT_EQ(Parse(document).normals.rows(), 4);
}

TEST(ParseGlb, RefusesBrokenContainers) {
  const std::string good = Glb(SquareDocument().dump(), SquareBinary());
  ASSERT_TRUE(ParseGlb(good).ok());
  EXPECT_EQ(RejectionOfBytes("glTX" + good.substr(4)), "GLB: the file does not begin with 'glTF'");
  EXPECT_EQ(RejectionOfBytes(good.substr(0, 11)), "GLB: the file does not begin with 'glTF'");
  std::string bytes = good;
  bytes[4] = 1;
  EXPECT_EQ(RejectionOfBytes(bytes), "GLB: version 1 is not supported (2 is)");
  EXPECT_THAT(RejectionOfBytes(good.substr(0, good.size() - 4)), HasSubstr("bytes, the file has"));
  bytes = good;
  bytes[15] = 1;  // the JSON chunk's length
  EXPECT_THAT(RejectionOfBytes(bytes), HasSubstr("reaches beyond the file's end"));
  bytes = good;
  bytes[16] = 'X';
  EXPECT_EQ(RejectionOfBytes(bytes), "GLB: there is no JSON chunk");
  EXPECT_EQ(RejectionOfBytes(Glb("{\"a\": }", "")), "GLB: the JSON chunk is not a well-formed object");
  EXPECT_EQ(RejectionOfBytes(Glb("[]", "")), "GLB: the JSON chunk is not a well-formed object");
  EXPECT_EQ(RejectionOfBytes(Glb(std::string(1000000, '['), "")), "GLB: JSON nested more than 64 deep");
  EXPECT_EQ(RejectionOfBytes(Glb("{}", "")), "GLB: there are no triangles in its scene");
}

TEST(ParseGlb, RefusesAccessorsOutOfBounds) {
  EXPECT_THAT(RejectionOf(With("/accessors/0/count", 5)),
              HasSubstr("accessors[0]: 5 elements reach beyond bufferViews[0]"));
  EXPECT_THAT(RejectionOf(With("/accessors/0/byteOffset", 4)),
              HasSubstr("4 elements reach beyond bufferViews[0]"));
  EXPECT_THAT(RejectionOf(With("/accessors/0/count", 1000000)),
              HasSubstr("'count' is 1000000, which is out of range"));
  EXPECT_THAT(RejectionOf(With("/accessors/0/count", -1)), HasSubstr("'count' is not a whole number"));
  EXPECT_THAT(RejectionOf(With("/accessors/0/count", 3.5)), HasSubstr("'count' is not a whole number"));
  EXPECT_THAT(RejectionOf(With("/accessors/0/bufferView", 2)), HasSubstr("bufferViews[2] does not exist"));
  EXPECT_THAT(RejectionOf(With("/bufferViews/0/byteOffset", 16)),
              HasSubstr("bufferViews[0] reaches beyond the binary chunk"));
  EXPECT_THAT(RejectionOf(With("/bufferViews/0/byteLength", 40)), HasSubstr("reach beyond bufferViews[0]"));
  EXPECT_THAT(RejectionOf(With("/bufferViews/0/byteStride", 8)),
              HasSubstr("'byteStride' 8 is less than an element's 12 bytes"));
  EXPECT_THAT(RejectionOf(With("/bufferViews/0/byteStride", 16)), HasSubstr("4 elements reach beyond"));
  EXPECT_THAT(RejectionOf(With("/bufferViews/0/byteStride", 1024)),
              HasSubstr("'byteStride' is 1024, which is out of range"));
  EXPECT_THAT(RejectionOf(With("/accessors/0/componentType", 5124)),
              HasSubstr("unknown 'componentType' 5124"));
  EXPECT_THAT(RejectionOf(With("/accessors/0/type", "VEC4")), HasSubstr("'type' is not VEC3"));
}

TEST(ParseGlb, RefusesIndicesOfOtherVertices) {
  EXPECT_THAT(RejectionOf(SquareDocument(), SquareBinary().substr(0, 58) + Packed<uint16_t>({4})),
              HasSubstr("meshes[0].primitives[0]: triangle 1 names vertex 4, but there are 4"));
  EXPECT_THAT(RejectionOf(With("/accessors/1/componentType", 5122)),
              HasSubstr("the indices are not unsigned integers"));
  EXPECT_THAT(RejectionOf(With("/accessors/1/count", 5)),
              HasSubstr("5 corners are no whole number of triangles"));
  EXPECT_THAT(RejectionOf(With("/meshes/0/primitives/0/indices", 7)),
              HasSubstr("'indices' is 7, which is out of range"));
}

TEST(ParseGlb, RefusesWhatItCannotDecode) {
  EXPECT_THAT(RejectionOf(With("/extensionsRequired", {"KHR_draco_mesh_compression"})),
              HasSubstr("Draco compression is not supported"));
  EXPECT_THAT(RejectionOf(With("/extensionsRequired", {"EXT_meshopt_compression"})),
              HasSubstr("meshopt compression is not supported"));
  EXPECT_THAT(RejectionOf(With("/meshes/0/primitives/0/extensions",
                               {{"KHR_draco_mesh_compression", Json::object()}})),
              HasSubstr("meshes[0].primitives[0]: Draco compression is not supported"));
  EXPECT_THAT(RejectionOf(With("/bufferViews/0/extensions", {{"EXT_meshopt_compression", Json::object()}})),
              HasSubstr("bufferViews[0]: meshopt compression is not supported"));
  EXPECT_THAT(RejectionOf(With("/accessors/0/sparse", Json::object())),
              HasSubstr("sparse accessors are not supported"));
  EXPECT_THAT(RejectionOf(With("/buffers/0/uri", "square.bin")),
              HasSubstr("not the file's own binary chunk"));
  EXPECT_TRUE(
      ParseGlb(Glb(With("/extensionsRequired", {"KHR_materials_unlit"}).dump(), SquareBinary())).ok());
}

TEST(ParseGlb, RefusesBrokenScenes) {
  Json document = With("/nodes/0/children", {0});
  EXPECT_THAT(RejectionOf(document), HasSubstr("nodes[0] has two parents or contains itself"));
  EXPECT_THAT(RejectionOf(With("/scenes/0/nodes", {0, 0})),
              HasSubstr("nodes[0] has two parents or contains itself"));
  EXPECT_THAT(RejectionOf(With("/scenes/0/nodes", {9})),
              HasSubstr("'nodes' names a node that does not exist"));
  EXPECT_THAT(RejectionOf(With("/nodes/0/children", {-1})),
              HasSubstr("'children' names a node that does not exist"));
  EXPECT_THAT(RejectionOf(With("/nodes/0/mesh", 1)), HasSubstr("'mesh' is 1, which is out of range"));
  EXPECT_THAT(RejectionOf(With("/nodes/0/matrix", {1, 2, 3})),
              HasSubstr("nodes[0]: 'matrix' is not 16 numbers"));
  EXPECT_THAT(RejectionOf(With("/nodes/0/rotation", {0, 0, "a", 1})),
              HasSubstr("'rotation' is not 4 numbers"));
  EXPECT_THAT(RejectionOf(With("/scene", 3)), HasSubstr("'scene' is 3, which is out of range"));
  EXPECT_THAT(RejectionOf(With("/meshes/0/primitives", 5)), HasSubstr("meshes[0] has no primitives"));
  EXPECT_THAT(RejectionOf(With("/meshes/0/primitives/0/attributes", Json::object())),
              HasSubstr("has no attribute 'POSITION'"));
  document = With("/meshes/0/primitives/0/attributes/NORMAL", 2);
  document["accessors"][2] = document["accessors"][0];
  document["accessors"][2]["count"] = 3;
  EXPECT_THAT(RejectionOf(document), HasSubstr("3 NORMAL values for 4 vertices"));
  EXPECT_THAT(RejectionOf(With("/meshes/0/primitives/0/mode", 1)),
              HasSubstr("there are no triangles in its scene"));
}

TEST(ParseGlb, DeepScenesAreWalkedWithoutRecursion) {
  constexpr int kDepth = 100000;
  Json document = SquareDocument();
  for (int n = 0; n < kDepth; ++n) document["nodes"][n] = {{"children", {n + 1}}};
  document["nodes"][kDepth] = {{"mesh", 0}};
  EXPECT_EQ(Parse(document).vertex_count(), 4);
}

TEST(ParseGlb, RefusesScenesThatBlowUp) {
  Json document = SquareDocument();
  constexpr int kVertices = 20000, kNodes = 1000;
  const std::string binary(12 * kVertices, '\0');
  document["accessors"] = {
      {{"bufferView", 0}, {"componentType", 5126}, {"count", kVertices}, {"type", "VEC3"}}};
  document["bufferViews"] = {{{"buffer", 0}, {"byteLength", binary.size()}}};
  document["meshes"][0]["primitives"] = {{{"attributes", {{"POSITION", 0}}}, {"mode", 5}}};
  Json nodes = Json::array();
  for (int n = 0; n < kNodes; ++n) {
    document["nodes"][n] = {{"mesh", 0}};
    nodes.push_back(n);
  }
  document["scenes"][0]["nodes"] = nodes;
  EXPECT_THAT(RejectionOf(document, binary), HasSubstr("more than 64 times as large as the file"));
}

TEST(SerializeGlb, FollowsTheSpecification) {
  for (const TriangleMesh& mesh : {testing::WithAttributes(testing::Icosphere(2)), testing::Box(),
                                   testing::WithAttributes(testing::Grid(300, 300))}) {
    const std::string bytes = SerializeGlb(mesh);
    EXPECT_EQ(bytes.size() % 4, 0u);
    EXPECT_EQ(LoadLittleEndian<uint32_t>(bytes.data() + 8), bytes.size());
    const GlbChunks chunks = SplitGlb(bytes).value();
    const Json& root = chunks.root;
    EXPECT_EQ(root["asset"]["version"], "2.0");
    EXPECT_EQ(root["buffers"][0]["byteLength"], chunks.binary.size());
    size_t end = 0;
    for (const Json& view : root["bufferViews"]) {
      EXPECT_EQ(view["byteOffset"].get<size_t>() % 4, 0u);
      EXPECT_GE(view["byteOffset"].get<size_t>(), end);
      end = view["byteOffset"].get<size_t>() + view["byteLength"].get<size_t>();
      EXPECT_LE(end, chunks.binary.size());
    }
    std::vector<MeshGroup> groups = mesh.groups;
    if (groups.empty()) groups.push_back({"", 0, mesh.face_count()});
    ASSERT_EQ(root["meshes"][0]["primitives"].size(), groups.size());
    for (size_t g = 0; g < groups.size(); ++g) {
      const Json& primitive = root["meshes"][0]["primitives"][g];
      const Json& positions = root["accessors"][primitive["attributes"]["POSITION"].get<int>()];
      for (int axis = 0; axis < 3; ++axis) {
        EXPECT_EQ(positions["min"][axis].get<float>(), mesh.positions.col(axis).minCoeff());
        EXPECT_EQ(positions["max"][axis].get<float>(), mesh.positions.col(axis).maxCoeff());
      }
      for (const Json& attribute : primitive["attributes"]) {
        const Json& accessor = root["accessors"][attribute.get<int>()];
        EXPECT_EQ(accessor["count"], mesh.vertex_count());
        EXPECT_EQ(root["bufferViews"][accessor["bufferView"].get<int>()]["target"], 34962);
      }
      const Json& indices = root["accessors"][primitive["indices"].get<int>()];
      EXPECT_EQ(root["bufferViews"][indices["bufferView"].get<int>()]["target"], 34963);
      const int32_t largest = mesh.faces.middleRows(groups[g].first_face, groups[g].face_count).maxCoeff();
      EXPECT_EQ(indices["componentType"], largest < 65535 ? 5123 : 5125);
    }
  }
}

TEST(SerializeGlb, WritesUnitNormalsWhateverItGets) {
  TriangleMesh mesh = testing::WithAttributes(testing::Box());
  mesh.normals.row(0).setZero();
  mesh.normals.row(1) << 3e-30f, 0, 0;
  mesh.normals.row(2) << 0, std::nanf(""), 1;
  const TriangleMesh parsed = ParseGlb(SerializeGlb(mesh)).value();
  for (int64_t v = 0; v < 8; ++v) EXPECT_NEAR(parsed.normals.row(v).norm(), 1.0f, 1e-6f);
  EXPECT_EQ(parsed.normals(1, 0), 1.0f);
}

}  // namespace
}  // namespace stance

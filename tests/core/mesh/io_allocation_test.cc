// No reader believes a file that announces more than it holds: every allocation of a read is counted.
#include <gtest/gtest.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <new>
#include <string>
#include <vector>

#include "core/mesh/mesh_io.h"
#include "tests/support/meshes.h"

namespace {

std::atomic<size_t> allocated = 0;

void* Counted(size_t size) {
  allocated += size;
  void* const memory = std::malloc(size);
  if (memory == nullptr) std::abort();
  return memory;
}

}  // namespace

void* operator new(size_t size) { return Counted(size); }
void* operator new[](size_t size) { return Counted(size); }
void operator delete(void* memory) noexcept { std::free(memory); }
void operator delete[](void* memory) noexcept { std::free(memory); }
void operator delete(void* memory, size_t) noexcept { std::free(memory); }
void operator delete[](void* memory, size_t) noexcept { std::free(memory); }

namespace stance {
namespace {

constexpr size_t kMiB = size_t{1} << 20;

// All that reading the bytes has allocated, freed or not.
size_t AllocatedBy(const std::string& bytes, MeshFormat format, bool* accepted) {
  const size_t before = allocated;
  *accepted = ParseMesh(bytes, format).ok();
  return allocated - before;
}

void AppendWord(uint32_t word, std::string* bytes) {
  for (int shift = 0; shift < 32; shift += 8) bytes->push_back(static_cast<char>(word >> shift & 0xff));
}

std::string Glb(std::string json, const std::string& binary) {
  json.resize((json.size() + 3) / 4 * 4, ' ');
  std::string bytes = "glTF";
  AppendWord(2, &bytes);
  AppendWord(static_cast<uint32_t>(12 + 8 + json.size() + 8 + binary.size()), &bytes);
  AppendWord(static_cast<uint32_t>(json.size()), &bytes);
  bytes += "JSON" + json;
  AppendWord(static_cast<uint32_t>(binary.size()), &bytes);
  return bytes + std::string("BIN\0", 4) + binary;
}

std::string GlbWithCount(const std::string& count) {
  return Glb(R"({"asset":{"version":"2.0"},"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],)"
             R"("accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":)" +
                 count + R"(}],"bufferViews":[{"buffer":0,"byteLength":)" + count +
                 R"(}],"buffers":[{"byteLength":)" + count + "}]}",
             std::string(36, '\0'));
}

struct Liar {
  const char* name;
  MeshFormat format;
  std::string bytes;
};

std::vector<Liar> Liars() {
  const std::string ply = "ply\nformat binary_little_endian 1.0\n";
  std::string stl(80, ' ');
  AppendWord(0xffffffff, &stl);
  return {
      {"PLY vertices", MeshFormat::kPly,
       ply + "element vertex 4000000000\nproperty float x\nproperty float y\nproperty float z\nend_header\n"},
      {"PLY faces", MeshFormat::kPly,
       ply + "element face 4000000000\nproperty list uint int vertex_indices\nend_header\n"},
      {"PLY corners", MeshFormat::kPly,
       ply + "element face 1\nproperty list uint int vertex_indices\nend_header\n\xff\xff\xff\xff"},
      {"PLY items without a size", MeshFormat::kPly, ply + "element vertex 4000000000\nend_header\n"},
      {"PLY text", MeshFormat::kPly,
       "ply\nformat ascii 1.0\nelement vertex 4000000000\nproperty float x\nproperty float y\n"
       "property float z\nend_header\n0 0 0\n"},
      {"OFF vertices", MeshFormat::kOff, "OFF\n4000000000 1 0\n0 0 0\n"},
      {"OFF faces", MeshFormat::kOff, "OFF\n1 4000000000 0\n0 0 0\n"},
      {"OFF corners", MeshFormat::kOff, "OFF\n1 1 0\n0 0 0\n4000000000 0 0 0\n"},
      {"STL", MeshFormat::kStl, stl},
      {"OBJ index", MeshFormat::kObj, "v 0 0 0\nf 2000000000 2000000000 1\n"},
      {"GLB count", MeshFormat::kGlb, GlbWithCount("4000000000")},
      {"GLB count beyond 64 bits", MeshFormat::kGlb, GlbWithCount("40000000000000000000")},
  };
}

TEST(IoAllocationTest, WhatIsAnnouncedIsNotAllocated) {
  for (const Liar& liar : Liars()) {
    bool accepted = false;
    EXPECT_LT(AllocatedBy(liar.bytes, liar.format, &accepted), kMiB) << liar.name;
    // An OBJ's indices are for CheckMesh.
    EXPECT_EQ(accepted, liar.format == MeshFormat::kObj) << liar.name;
  }
}

TEST(IoAllocationTest, AnHonestFileTakesASmallMultipleOfItsBytes) {
  const TriangleMesh mesh = testing::WithAttributes(testing::Icosphere(5));
  for (const MeshFormat format :
       {MeshFormat::kObj, MeshFormat::kPly, MeshFormat::kOff, MeshFormat::kStl, MeshFormat::kGlb}) {
    const std::string bytes = SerializeMesh(mesh, format).value();
    bool accepted = false;
    EXPECT_LT(AllocatedBy(bytes, format, &accepted), 16 * bytes.size()) << MeshFormatName(format);
    EXPECT_TRUE(accepted);
  }
}

// JSON takes many times its bytes as values; a mesh's own is a few kilobytes.
TEST(IoAllocationTest, ALargeJsonChunkIsNotParsed) {
  std::string json = R"({"asset":{"version":"2.0"},"extras":[0)";
  while (json.size() < 17 * kMiB) json += ",{}";
  bool accepted = true;
  EXPECT_LT(AllocatedBy(Glb(json + "]}", std::string(36, '\0')), MeshFormat::kGlb, &accepted), kMiB);
  EXPECT_FALSE(accepted);
}

}  // namespace
}  // namespace stance

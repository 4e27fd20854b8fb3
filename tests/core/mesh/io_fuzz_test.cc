// Broken bytes at every reader: whatever comes in, the answer is a mesh or INVALID_ARGUMENT.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/mesh/mesh_check.h"
#include "core/mesh/mesh_io.h"
#include "tests/support/meshes.h"

namespace stance {
namespace {

constexpr int kTruncations = 400;
constexpr int kMutations = 4000;

class AnyBytes : public ::testing::TestWithParam<MeshFormat> {
 protected:
  // Reads, and where that works, checks and writes: nothing behind the reader may trip over its result
  // either.
  void Try(const std::string& bytes) {
    const absl::StatusOr<TriangleMesh> mesh = ParseMesh(bytes, GetParam());
    if (!mesh.ok()) {
      ASSERT_EQ(mesh.status().code(), absl::StatusCode::kInvalidArgument) << mesh.status();
      ASSERT_FALSE(mesh.status().message().empty());
      ASSERT_LT(mesh.status().message().size(), 1000u);
      return;
    }
    ++accepted_;
    ASSERT_LE(mesh->vertex_count() + mesh->face_count(), static_cast<int64_t>(20 * bytes.size()) + 100000);
    const absl::StatusOr<MeshReport> report = CheckMesh(*mesh);
    ASSERT_TRUE(report.ok() || report.status().code() == absl::StatusCode::kInvalidArgument);
    const absl::StatusOr<std::string> written = SerializeMesh(*mesh, GetParam());
    if (written.ok()) {
      ASSERT_TRUE(ParseMesh(*written, GetParam()).ok());
    }
  }

  // Valid files of the format, small enough that a random byte has an effect.
  std::vector<std::string> ValidFiles() const {
    std::vector<std::string> files;
    TriangleMesh box = testing::WithAttributes(testing::Box());
    files.push_back(SerializeMesh(box, GetParam()).value());
    files.push_back(SerializeMesh(testing::Icosphere(1), GetParam()).value());
    switch (GetParam()) {
      case MeshFormat::kObj:
        files.push_back(
            "o a\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\ng b\\\nc\nf -4/-1/-1 2//1 3/1 4\n");
        break;
      case MeshFormat::kPly:
        files.push_back(
            "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty double y\nproperty uchar z\n"
            "element face 1\nproperty list uchar int vertex_indices\nproperty list int float "
            "extra\nend_header\n"
            "0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3 2 5 6\n");
        break;
      case MeshFormat::kOff:
        files.push_back(
            "STCNOFF 3 1 0\n0 0 0 0 0 1 9 9 9 0 0\n1 0 0 0 0 1 9 9 9 0 0\n0 1 0 0 0 1 9 9 9 1 1\n3 0 1 2\n");
        break;
      case MeshFormat::kStl:
        files.push_back(
            "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1e0 "
            "0\nendloop\nendfacet\n"
            "endsolid a\n");
        break;
      case MeshFormat::kGlb:
        break;
    }
    return files;
  }

  int accepted_ = 0;
};

INSTANTIATE_TEST_SUITE_P(MeshIo, AnyBytes,
                         ::testing::Values(MeshFormat::kObj, MeshFormat::kPly, MeshFormat::kOff,
                                           MeshFormat::kStl, MeshFormat::kGlb),
                         [](const auto& format) { return std::string(MeshFormatName(format.param)); });

TEST_P(AnyBytes, TruncatedFiles) {
  for (const std::string& file : ValidFiles()) {
    const int count = std::min<int>(kTruncations, static_cast<int>(file.size()));
    for (int k = 0; k < count; ++k) ASSERT_NO_FATAL_FAILURE(Try(file.substr(0, file.size() * k / count)));
    accepted_ = 0;
    Try(file);
    EXPECT_EQ(accepted_, 1) << "the whole file is valid";
  }
}

TEST_P(AnyBytes, TruncatedBinaryFilesAreRefused) {
  if (GetParam() == MeshFormat::kObj || GetParam() == MeshFormat::kOff) return;  // any line may be the last
  const std::string file = SerializeMesh(testing::Icosphere(1), GetParam()).value();
  for (size_t size = 0; size < file.size(); ++size) {
    ASSERT_FALSE(ParseMesh(file.substr(0, size), GetParam()).ok()) << size;
  }
}

TEST_P(AnyBytes, MutatedFiles) {
  Random random(17);
  for (const std::string& file : ValidFiles()) {
    for (int k = 0; k < kMutations; ++k) {
      std::string bytes = file;
      for (int64_t change = random.Below(4); change >= 0; --change) {
        const size_t at = static_cast<size_t>(random.Below(std::ssize(bytes)));
        switch (random.Below(5)) {
          case 0:
            bytes[at] = static_cast<char>(random.Below(256));
            break;
          case 1:
            bytes[at] = static_cast<char>(bytes[at] ^ (1 << random.Below(8)));
            break;
          case 2:
            bytes[at] = "0123456789-+.eE /\\\n\t{}[],:\""[random.Below(27)];
            break;
          case 3:
            bytes.erase(at, static_cast<size_t>(random.Below(8)));
            break;
          default:
            bytes.insert(at, bytes.substr(static_cast<size_t>(random.Below(std::ssize(bytes))),
                                          static_cast<size_t>(random.Below(16))));
        }
        if (bytes.empty()) break;
      }
      ASSERT_NO_FATAL_FAILURE(Try(bytes));
    }
  }
  EXPECT_GT(accepted_, 0) << "no mutation got past the reader";
}

TEST_P(AnyBytes, RandomBytesBehindAValidBeginning) {
  const char* const beginnings[] = {
      "",
      "v ",
      "v 0 0 0\nf ",
      "OFF\n",
      "OFF 3 1 0\n",
      "STCNOFF\n2 2 2\n",
      "solid\n",
      "solid x\nfacet normal ",
      "ply\n",
      "ply\nformat binary_little_endian 1.0\nelement vertex 9\nproperty float x\nproperty float y\n"
      "property float z\nelement face 99\nproperty list uint int vertex_indices\nend_header\n",
      "glTF",
      "ply\nformat ascii 1.0\nelement vertex 9\nproperty list int int x\nend_header\n"};
  Random random(23);
  for (const char* beginning : beginnings) {
    for (int k = 0; k < 200; ++k) {
      std::string bytes = beginning;
      const int64_t size = random.Below(600);
      const bool text = random.Chance(0.5);
      for (int64_t b = 0; b < size; ++b) {
        bytes += text ? "0123456789-.e \n"[random.Below(15)] : static_cast<char>(random.Below(256));
      }
      ASSERT_NO_FATAL_FAILURE(Try(bytes));
    }
  }
}

TEST_P(AnyBytes, LongRunsOfOneByte) {
  for (const char c : {'\0', ' ', '\n', '\\', '0', '9', '/', '[', '"', '#', '\xff', 'v', 'f'}) {
    for (const std::string beginning : {"", "v ", "f ", "v 1 2 3\nf ", "OFF ", "solid ", "ply\n", "glTF"}) {
      ASSERT_NO_FATAL_FAILURE(Try(beginning + std::string(200000, c)));
    }
  }
  std::string continued = "v 0 0 0\nf";
  for (int k = 0; k < 50000; ++k) continued += " 1\\\n";
  ASSERT_NO_FATAL_FAILURE(Try(continued));
}

}  // namespace
}  // namespace stance

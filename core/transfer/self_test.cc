#include "core/transfer/self_test.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "core/base/files.h"
#include "core/base/random.h"
#include "core/mesh/mesh_check.h"
#include "core/network/model_digests.h"
#include "core/network/model_manifest.h"

namespace stance {
namespace {

using nlohmann::ordered_json;

constexpr int kFormatVersion = 1;
// Bounds of the tolerances; the joints' are of the mesh's height: 3 to 17 cm of a body. A model that a trace
// of noise moves further is not worth serving.
constexpr double kLeastJoint = 0.02, kMostJoint = 0.1;
constexpr double kLeastRotation = 15 * std::numbers::pi / 180, kMostRotation = 2 * kLeastRotation;
// Other processors round otherwise, which may move surface samples and with them the answer as far as a trace
// of noise does. So many noisy copies show how far that is, and this many times as far is still right.
constexpr int kNoisyCopies = 8;
constexpr double kNoise = 1e-5;  // of the mesh's height
constexpr double kMargin = 3;
// Of a unit: a tenth of a millimetre of a body, so that the file stays small.
constexpr double kDecimals = 1e4;

double Rounded(double number) { return std::round(number * kDecimals) / kDecimals; }

template <typename Matrix>
ordered_json RowsOf(const Matrix& matrix) {
  std::vector<double> numbers;
  for (Eigen::Index row = 0; row < matrix.rows(); ++row) {
    for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
      numbers.push_back(Rounded(matrix(row, column)));
    }
  }
  return numbers;
}

// (N, columns) of a flat array; throws as the JSON library does.
template <typename Matrix>
Matrix MatrixOf(const ordered_json& array, Eigen::Index columns) {
  const auto numbers = array.get<std::vector<double>>();
  Matrix matrix(static_cast<Eigen::Index>(numbers.size()) / columns, columns);
  for (Eigen::Index i = 0; i < matrix.size(); ++i) {
    matrix(i / columns, i % columns) = static_cast<typename Matrix::Scalar>(numbers[i]);
  }
  return matrix;
}

double HeightOf(const TriangleMesh& mesh) {
  return mesh.positions.col(1).maxCoeff() - mesh.positions.col(1).minCoeff();
}

TriangleMesh WithNoise(TriangleMesh mesh, uint64_t seed) {
  Random random(seed);
  const double scale = kNoise * HeightOf(mesh);
  for (Eigen::Index i = 0; i < mesh.positions.size(); ++i) {
    mesh.positions.data()[i] += static_cast<float>(random.Uniform(-scale, scale));
  }
  return mesh;
}

double AngleBetween(const Rotation& a, const Rotation& b) {
  return std::acos(std::clamp(((a.transpose() * b).trace() - 1.0) / 2, -1.0, 1.0));
}

absl::StatusOr<Method> MethodOf(const Pipeline& pipeline, const ModelManifest& manifest) {
  for (const ModelInfo& model : pipeline.models()) {
    if (model.name == manifest.name) return model.method;
  }
  return absl::FailedPreconditionError(fmt::format("the model '{}' is not loaded", manifest.name));
}

absl::StatusOr<Rig> RigOf(const Pipeline& pipeline, const std::filesystem::path& model_dir,
                          const TriangleMesh& mesh) {
  STANCE_ASSIGN_OR_RETURN(const ModelManifest manifest, ReadManifest(model_dir));
  STANCE_ASSIGN_OR_RETURN(const Method method, MethodOf(pipeline, manifest));
  STANCE_ASSIGN_OR_RETURN(RigResult result, pipeline.RigMesh(mesh, {.method = method}));
  return std::move(result.rig);
}

}  // namespace

absl::StatusOr<SelfTest> ReadSelfTest(const std::filesystem::path& model_dir) {
  const auto path = model_dir / kSelfTestFile;
  STANCE_ASSIGN_OR_RETURN(const std::string text, ReadFile(path));
  const auto bad = [&](const std::string& why) {
    return absl::InvalidArgumentError(fmt::format("{}: {}", path.string(), why));
  };
  SelfTest test;
  try {
    const ordered_json json = ordered_json::parse(text);
    if (json.at("format_version").get<int>() != kFormatVersion) return bad("format_version is not 1");
    test.mesh.positions = MatrixOf<Points>(json.at("positions"), 3);
    test.mesh.faces = MatrixOf<Faces>(json.at("faces"), 3);
    test.joints = MatrixOf<Points>(json.at("joints"), 3);
    const RowMatrix rotations = MatrixOf<RowMatrix>(json.at("rotations"), 9);
    for (Eigen::Index j = 0; j < rotations.rows(); ++j) {
      test.rotations.push_back(
          Eigen::Map<const Eigen::Matrix<float, 3, 3, Eigen::RowMajor>>(RowMatrix(rotations.row(j)).data()));
    }
    test.joint_tolerance = json.at("joint_tolerance").get<double>();
    test.rotation_tolerance = json.at("rotation_tolerance").get<double>();
  } catch (const ordered_json::exception& error) {
    return bad(error.what());
  }
  if (const auto report = CheckMesh(test.mesh); !report.ok())
    return bad(std::string(report.status().message()));
  if (!(test.joint_tolerance > 0 && test.rotation_tolerance > 0)) return bad("a tolerance is not above 0");
  return test;
}

absl::Status CompareWithSelfTest(const SelfTest& test, const Rig& rig) {
  if (rig.joints.rows() != test.joints.rows() || rig.rotations.size() != test.rotations.size()) {
    return absl::FailedPreconditionError(
        fmt::format("self-test: {} joints and {} rotations in place of {} and {}", rig.joints.rows(),
                    rig.rotations.size(), test.joints.rows(), test.rotations.size()));
  }
  for (Eigen::Index j = 0; j < test.joints.rows(); ++j) {
    const double distance = (rig.joints.row(j) - test.joints.row(j)).norm();
    // Written so that a NaN fails too.
    if (!(distance <= test.joint_tolerance)) {
      return absl::FailedPreconditionError(fmt::format(
          "self-test: joint {} is off by {:.4g}, more than {:.4g}", j, distance, test.joint_tolerance));
    }
  }
  for (size_t j = 0; j < test.rotations.size(); ++j) {
    const double angle = AngleBetween(rig.rotations[j], test.rotations[j]);
    if (!(angle <= test.rotation_tolerance)) {
      return absl::FailedPreconditionError(
          fmt::format("self-test: the rotation of joint {} is off by {:.4g} radians, more than {:.4g}", j,
                      angle, test.rotation_tolerance));
    }
  }
  return absl::OkStatus();
}

absl::Status RunSelfTests(const Pipeline& pipeline, const std::vector<std::filesystem::path>& folders,
                          std::vector<std::string>& untested) {
  for (const std::filesystem::path& folder : folders) {
    const absl::StatusOr<SelfTest> test = ReadSelfTest(folder);
    if (absl::IsNotFound(test.status())) {
      untested.push_back(folder.string());
      continue;
    }
    if (!test.ok()) return test.status();
    const absl::StatusOr<Rig> rig = RigOf(pipeline, folder, test->mesh);
    const absl::Status status = rig.ok() ? CompareWithSelfTest(*test, *rig) : rig.status();
    if (!status.ok()) {
      return absl::Status(status.code(),
                          fmt::format("{}: {}", folder.string(), std::string(status.message())));
    }
  }
  return absl::OkStatus();
}

absl::Status WriteSelfTest(const std::filesystem::path& model_dir, const TriangleMesh& mesh) {
  // The mesh as it will be read back, so that the answer is that mesh's.
  TriangleMesh sample;
  sample.positions = MatrixOf<Points>(RowsOf(mesh.positions), 3);
  sample.faces = mesh.faces;
  STANCE_ASSIGN_OR_RETURN(const ModelManifest manifest, ReadManifest(model_dir));
  STANCE_ASSIGN_OR_RETURN(const std::unique_ptr<Pipeline> pipeline, Pipeline::Load(model_dir));
  STANCE_ASSIGN_OR_RETURN(const Rig rig, RigOf(*pipeline, model_dir, sample));
  RowMatrix rotations(static_cast<Eigen::Index>(rig.rotations.size()), 9);
  for (size_t j = 0; j < rig.rotations.size(); ++j) {
    const Eigen::Matrix<float, 3, 3, Eigen::RowMajor> rows = rig.rotations[j];
    rotations.row(static_cast<Eigen::Index>(j)) = Eigen::Map<const Eigen::Matrix<float, 1, 9>>(rows.data());
  }
  const double height = HeightOf(sample);
  double joint = 0, rotation = 0;  // how far the noise moves them at most
  for (int copy = 0; copy < kNoisyCopies; ++copy) {
    STANCE_ASSIGN_OR_RETURN(const Rig noisy, RigOf(*pipeline, model_dir, WithNoise(sample, copy)));
    for (Eigen::Index j = 0; j < rig.joints.rows(); ++j) {
      const double distance = (noisy.joints.row(j) - rig.joints.row(j)).norm();
      joint = std::max(joint, distance);
    }
    for (size_t j = 0; j < rig.rotations.size(); ++j) {
      const double angle = AngleBetween(noisy.rotations[j], rig.rotations[j]);
      rotation = std::max(rotation, angle);
    }
  }
  const ordered_json json = {
      {"format_version", kFormatVersion},
      {"joint_tolerance", Rounded(std::clamp(kMargin * joint, kLeastJoint * height, kMostJoint * height))},
      {"rotation_tolerance", Rounded(std::clamp(kMargin * rotation, kLeastRotation, kMostRotation))},
      {"joints", RowsOf(rig.joints)},
      {"rotations", RowsOf(rotations)},
      {"positions", RowsOf(sample.positions)},
      {"faces", RowsOf(sample.faces)}};
  STANCE_RETURN_IF_ERROR(WriteFile(model_dir / kSelfTestFile, json.dump() + "\n"));
  return WriteDigests(model_dir, {manifest.weights, kSelfTestFile});
}

}  // namespace stance

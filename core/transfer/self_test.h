// A model's stored sample with the answer that it must give: finds weights that do not go with this program
// or with each other, which no checksum does.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/transfer/pipeline.h"

namespace stance {

inline constexpr char kSelfTestFile[] = "self_test.json";

// A mesh and where the model finds its joints, in the mesh's frame and unit. The tolerances are wide enough
// for other processors' rounding, which may move surface samples, and far narrower than what wrong weights
// do.
struct SelfTest {
  TriangleMesh mesh;                // positions and faces
  Points joints;                    // (J, 3)
  std::vector<Rotation> rotations;  // (J) global; empty if the method does not know them
  double joint_tolerance = 0;       // distance
  double rotation_tolerance = 0;    // radians
};

// NOT_FOUND if the model has none, INVALID_ARGUMENT for a malformed one; with the path.
absl::StatusOr<SelfTest> ReadSelfTest(const std::filesystem::path& model_dir);

// FAILED_PRECONDITION with the joint and the numbers where `rig` is off by more than the tolerances.
absl::Status CompareWithSelfTest(const SelfTest& test, const Rig& rig);

// Rigs the sample of each model in `folders`, those that `pipeline` was loaded from; an error begins with the
// folder. The models without a sample are appended to `untested`, by folder.
absl::Status RunSelfTests(const Pipeline& pipeline, const std::vector<std::filesystem::path>& folders,
                          std::vector<std::string>& untested);

// Makes the model's present answer for `mesh` its self-test, with tolerances after what a trace of
// noise does to it, and lists weights and self-test with their SHA-256 in the manifest. The mesh should be a
// small one: the file takes about 50 bytes a vertex.
absl::Status WriteSelfTest(const std::filesystem::path& model_dir, const TriangleMesh& mesh);

}  // namespace stance

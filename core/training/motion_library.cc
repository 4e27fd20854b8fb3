#include "core/training/motion_library.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>
#include <utility>

#include "core/base/files.h"
#include "core/skeleton/mirror.h"

namespace stance {
namespace {

constexpr float kQuaternionSteps = 32767.0f;

// Where a canonical joint's rotation comes from.
struct Source {
  std::string_view joint;     // of the BVH skeleton
  std::string_view bone_end;  // its bone runs to this joint; empty: the rotation is taken as it is
};

// Spines, necks and feet differ in shape more than in pose, so their bones are not laid along each other.
constexpr std::array<Source, kHumanJoints> kSources = {
    {{"hip", ""},           {"lThigh", "lShin"},    {"rThigh", "rShin"},
     {"abdomen", ""},       {"lShin", "lFoot"},     {"rShin", "rFoot"},
     {"abdomen", ""},       {"lFoot", ""},          {"rFoot", ""},
     {"chest", ""},         {"lFoot", ""},          {"rFoot", ""},
     {"neck", ""},          {"lCollar", ""},        {"rCollar", ""},
     {"head", ""},          {"lShldr", "lForeArm"}, {"rShldr", "rForeArm"},
     {"lForeArm", "lHand"}, {"rForeArm", "rHand"},  {"lHand", "lMid1"},
     {"rHand", "rMid1"},    {"lHand", "lMid1"},     {"rHand", "rMid1"}}};

int FindJoint(const BvhClip& bvh, std::string_view name) {
  for (size_t j = 0; j < bvh.joints.size(); ++j) {
    if (bvh.joints[j].name == name) return static_cast<int>(j);
  }
  return -1;
}

bool IsZeroPose(const std::vector<Rotation>& rotations) {
  return std::all_of(rotations.begin(), rotations.end(), [](const Rotation& r) {
    return (r - Rotation::Identity()).norm() < 0.05f;  // about 2 degrees
  });
}

std::vector<Rotation> Decode(const MotionClip& clip, int64_t frame) {
  std::vector<Rotation> local(kHumanJoints);
  const int16_t* q = &clip.quaternions[frame * 4 * kHumanJoints];
  for (int j = 0; j < kHumanJoints; ++j, q += 4) {
    const Eigen::Quaternionf quaternion(q[0], q[1], q[2], q[3]);
    // A damaged zero would become NaN.
    local[j] =
        quaternion.squaredNorm() > 0 ? quaternion.normalized().toRotationMatrix() : Rotation::Identity();
  }
  return local;
}

}  // namespace

absl::StatusOr<MotionClip> RetargetClip(const BvhClip& bvh, std::string name, const Points& rest) {
  const Skeleton& skeleton = HumanSkeleton();
  std::array<int, kHumanJoints> source;
  std::vector<Rotation> align(kHumanJoints, Rotation::Identity());
  for (int j = 0; j < kHumanJoints; ++j) {
    source[j] = FindJoint(bvh, kSources[j].joint);
    if (source[j] < 0) {
      return absl::InvalidArgumentError(fmt::format("{}: no joint {}", name, kSources[j].joint));
    }
    if (kSources[j].bone_end.empty()) continue;
    const int end = FindJoint(bvh, kSources[j].bone_end);
    if (end < 0 || bvh.joints[end].parent != source[j]) {
      return absl::InvalidArgumentError(
          fmt::format("{}: no joint {} on {}", name, kSources[j].bone_end, kSources[j].joint));
    }
    // A hand moves with its wrist.
    const int joint = skeleton.is_leaf(j) ? skeleton.parents()[j] : j;
    const Eigen::Vector3f bone = (rest.row(skeleton.children(joint)[0]) - rest.row(joint)).transpose();
    align[j] = SmallestRotation(bone, bvh.joints[end].offset);
  }

  MotionClip clip;
  clip.name = std::move(name);
  for (int frame = 0; frame < bvh.frames.rows(); ++frame) {
    const std::vector<Rotation> captured = PoseOfFrame(bvh, frame).rotations;
    if (IsZeroPose(captured)) continue;
    std::vector<Rotation> global(kHumanJoints);
    for (int j = 0; j < kHumanJoints; ++j) global[j] = captured[source[j]] * align[j];
    // Three spine joints for the BVH's two: the lowest turns half as far.
    global[kSpine1] = Eigen::Quaternionf(global[kPelvis])
                          .slerp(0.5f, Eigen::Quaternionf(global[kSpine2]))
                          .toRotationMatrix();
    for (int j = 0; j < kHumanJoints; ++j) {
      const int parent = skeleton.parents()[j];
      Eigen::Quaternionf local(parent < 0 ? global[j] : Rotation(global[parent].transpose() * global[j]));
      local.normalize();
      for (const float part : {local.w(), local.x(), local.y(), local.z()}) {
        clip.quaternions.push_back(static_cast<int16_t>(std::lround(part * kQuaternionSteps)));
      }
    }
  }
  return clip;
}

MotionLibrary::MotionLibrary(std::vector<MotionClip> clips) : clips_(std::move(clips)) {
  for (size_t c = 0; c < clips_.size(); ++c) {
    std::vector<Frame>& frames = frames_[static_cast<int>(SplitOfClip(clips_[c].name))];
    for (int64_t f = 0; f < clips_[c].frame_count(); ++f) {
      frames.push_back({static_cast<int32_t>(c), static_cast<int32_t>(f)});
    }
  }
}

Split MotionLibrary::SplitOfClip(std::string_view name) {
  uint64_t hash = 0xcbf29ce484222325ULL;  // FNV-1a
  for (const char c : name) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3ULL;
  const uint64_t tenth = (hash >> 32) % 10;
  return tenth < 8 ? Split::kTrain : tenth == 8 ? Split::kValidation : Split::kTest;
}

std::optional<std::vector<Rotation>> MotionLibrary::Sample(Random& random, Split split) const {
  const std::vector<Frame>& frames = frames_[static_cast<int>(split)];
  if (frames.empty()) return std::nullopt;
  const Frame frame = frames[random.Below(static_cast<int64_t>(frames.size()))];
  std::vector<Rotation> local = Decode(clips_[frame.clip], frame.frame);
  if (random.Chance(0.5)) local = MirroredRotations(local);
  // The heading of the pelvis about +y is the clip's accident; a body that looks straight up or down keeps
  // it.
  const Eigen::Vector3f forward = local[kPelvis].col(2);
  if (std::hypot(forward.x(), forward.z()) > 0.1f) {
    const float heading = std::atan2(forward.x(), forward.z());
    local[kPelvis] = Eigen::AngleAxisf(-heading, Eigen::Vector3f::UnitY()) * local[kPelvis];
  }
  return local;
}

absl::StatusOr<std::vector<MotionClip>> ReadMotions(const std::filesystem::path& bvh_dir,
                                                    const Points& rest) {
  std::vector<std::filesystem::path> files;
  std::error_code error;
  for (std::filesystem::directory_iterator entry(bvh_dir, error), end; !error && entry != end;
       entry.increment(error)) {
    if (entry->path().extension() == ".bvh") files.push_back(entry->path());
  }
  if (files.empty()) return absl::NotFoundError(fmt::format("{}: no *.bvh files", bvh_dir.string()));
  std::sort(files.begin(), files.end());
  std::vector<MotionClip> clips;
  for (const std::filesystem::path& file : files) {
    STANCE_ASSIGN_OR_RETURN(const std::string text, ReadFile(file));
    const absl::StatusOr<BvhClip> bvh = ParseBvh(text);
    if (!bvh.ok()) {
      return absl::InvalidArgumentError(
          fmt::format("{}: {}", file.string(), std::string(bvh.status().message())));
    }
    STANCE_ASSIGN_OR_RETURN(MotionClip clip, RetargetClip(*bvh, file.stem().string(), rest));
    clips.push_back(std::move(clip));
  }
  return clips;
}

}  // namespace stance

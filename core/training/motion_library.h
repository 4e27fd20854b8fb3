// Captured poses on the canonical skeleton.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/random.h"
#include "core/base/status.h"
#include "core/skeleton/kinematics.h"
#include "core/training/bvh.h"
#include "core/training/character_generator.h"

namespace stance {

// A clip's poses: each joint's rotation relative to its parent, as unit quaternions (w, x, y, z) in steps of
// 1 / 32767.
struct MotionClip {
  std::string name;
  std::vector<int16_t> quaternions;  // (frames, 24, 4)

  int64_t frame_count() const { return static_cast<int64_t>(quaternions.size()) / (4 * kHumanJoints); }
};

// Carries a clip on the CMU skeleton (as cgspeed converted it) to the canonical one, whose rest joints are
// `rest` (24, 3). INVALID_ARGUMENT, naming the joint, for a clip on another skeleton.
//
// Each joint's global rotation from the BVH's own zero pose (a T pose facing +z) is taken over, after the
// smallest rotation that lays our resting bone along the BVH's. Frames in the zero pose itself are dropped.
absl::StatusOr<MotionClip> RetargetClip(const BvhClip& bvh, std::string name, const Points& rest);

// All poses, divided among the splits by a hash of the clips' names: 80, 10 and 10 %. Immutable.
class MotionLibrary {
 public:
  explicit MotionLibrary(std::vector<MotionClip> clips);

  static Split SplitOfClip(std::string_view name);

  // A random frame of the split's clips, mirrored half of the time, turned to face +z: local rotations (24).
  // Nothing if the split has no frames.
  std::optional<std::vector<Rotation>> Sample(Random& random, Split split) const;

  const std::vector<MotionClip>& clips() const { return clips_; }

 private:
  struct Frame {
    int32_t clip;
    int32_t frame;
  };
  std::vector<MotionClip> clips_;
  std::vector<Frame> frames_[3];  // by split
};

// Every *.bvh of a folder, retargeted, in the order of their names. NOT_FOUND for a missing or empty folder.
absl::StatusOr<std::vector<MotionClip>> ReadMotions(const std::filesystem::path& bvh_dir, const Points& rest);

}  // namespace stance

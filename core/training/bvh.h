// Biovision motion capture files.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/status.h"
#include "core/base/types.h"
#include "core/skeleton/kinematics.h"

namespace stance {

enum class BvhChannel { kXPosition, kYPosition, kZPosition, kXRotation, kYRotation, kZRotation };

struct BvhJoint {
  std::string name;
  int parent = -1;                                   // before the joint itself
  Eigen::Vector3f offset = Eigen::Vector3f::Zero();  // from the parent, in the file's unit of length
  std::vector<BvhChannel> channels;                  // in the file's order: R = first * second * third
  int first_channel = 0;                             // its column in BvhClip::frames
};

struct BvhClip {
  std::vector<BvhJoint> joints;  // end sites are left out
  RowMatrix frames;              // (frames, channels): the file's units and degrees
  double frame_time = 0;         // seconds
};

// INVALID_ARGUMENT, with the line, for anything but a well-formed file. Never crashes, whatever the text.
absl::StatusOr<BvhClip> ParseBvh(std::string_view text);

struct BvhPose {
  std::vector<Rotation> rotations;  // global; all identity in the pose of the offsets
  Points positions;                 // global, in the file's unit of length
};

// REQUIRES: 0 <= frame < clip.frames.rows().
BvhPose PoseOfFrame(const BvhClip& clip, int frame);

}  // namespace stance

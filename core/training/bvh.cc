#include "core/training/bvh.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <optional>
#include <system_error>

#include "core/base/check.h"

namespace stance {
namespace {

constexpr float kRadiansPerDegree = 0.017453292519943295f;
constexpr int kMaxJoints = 1000;
constexpr std::array<std::string_view, 6> kChannelNames = {"Xposition", "Yposition", "Zposition",
                                                           "Xrotation", "Yrotation", "Zrotation"};

// Recursive descent without recursion: the hierarchy's depth is the file's to choose.
class BvhParser {
 public:
  explicit BvhParser(std::string_view text) : text_(text) {}

  absl::StatusOr<BvhClip> Parse() {
    STANCE_RETURN_IF_ERROR(ParseHierarchy());
    STANCE_RETURN_IF_ERROR(ParseMotion());
    return std::move(clip_);
  }

 private:
  absl::Status Error(std::string_view expected) const {
    return absl::InvalidArgumentError(
        fmt::format("BVH line {}: expected {}, found '{}'", line_, expected, word_.substr(0, 40)));
  }

  // Reads the next word; empty at the end.
  std::string_view Next() {
    while (!text_.empty() && IsBlank(text_[0])) {
      if (text_[0] == '\n') ++line_;
      text_.remove_prefix(1);
    }
    size_t end = 0;
    while (end < text_.size() && !IsBlank(text_[end])) ++end;
    word_ = text_.substr(0, end);
    text_.remove_prefix(end);
    return word_;
  }

  static bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\n'; }

  absl::Status Expect(std::string_view word) { return Next() == word ? absl::OkStatus() : Error(word); }

  template <typename Number>
  absl::Status ReadNumber(Number& value) {
    Next();
    const char* const end = word_.data() + word_.size();
    const auto [stop, error] = std::from_chars(word_.data(), end, value);
    if (error != std::errc() || stop != end || !std::isfinite(static_cast<double>(value))) {
      return Error("a number");
    }
    return absl::OkStatus();
  }

  absl::Status ReadOffset(Eigen::Vector3f& offset) {
    STANCE_RETURN_IF_ERROR(Expect("OFFSET"));
    for (int c = 0; c < 3; ++c) STANCE_RETURN_IF_ERROR(ReadNumber(offset[c]));
    return absl::OkStatus();
  }

  absl::Status ReadChannels(BvhJoint& joint) {
    STANCE_RETURN_IF_ERROR(Expect("CHANNELS"));
    int count = 0;
    STANCE_RETURN_IF_ERROR(ReadNumber(count));
    if (count < 0 || count > 6) return Error("0 to 6 channels");
    joint.first_channel = channel_count_;
    for (int i = 0; i < count; ++i) {
      Next();
      const auto found = std::find(kChannelNames.begin(), kChannelNames.end(), word_);
      if (found == kChannelNames.end()) return Error("a channel's name");
      joint.channels.push_back(static_cast<BvhChannel>(found - kChannelNames.begin()));
    }
    channel_count_ += count;
    return absl::OkStatus();
  }

  absl::Status ParseHierarchy() {
    STANCE_RETURN_IF_ERROR(Expect("HIERARCHY"));
    STANCE_RETURN_IF_ERROR(Expect("ROOT"));
    std::vector<int> open;  // the joints whose braces are open
    do {
      BvhJoint joint;
      joint.name = std::string(Next());
      joint.parent = open.empty() ? -1 : open.back();
      if (static_cast<int>(clip_.joints.size()) >= kMaxJoints) return Error("at most 1000 joints");
      STANCE_RETURN_IF_ERROR(Expect("{"));
      STANCE_RETURN_IF_ERROR(ReadOffset(joint.offset));
      STANCE_RETURN_IF_ERROR(ReadChannels(joint));
      open.push_back(static_cast<int>(clip_.joints.size()));
      clip_.joints.push_back(std::move(joint));
      while (!open.empty() && Next() != "JOINT") {
        if (word_ == "}") {
          open.pop_back();
        } else if (word_ == "End") {
          Eigen::Vector3f unused;
          STANCE_RETURN_IF_ERROR(Expect("Site"));
          STANCE_RETURN_IF_ERROR(Expect("{"));
          STANCE_RETURN_IF_ERROR(ReadOffset(unused));
          STANCE_RETURN_IF_ERROR(Expect("}"));
        } else {
          return Error("JOINT, End Site or }");
        }
      }
    } while (!open.empty());
    return absl::OkStatus();
  }

  absl::Status ParseMotion() {
    int64_t frames = 0;
    STANCE_RETURN_IF_ERROR(Expect("MOTION"));
    STANCE_RETURN_IF_ERROR(Expect("Frames:"));
    STANCE_RETURN_IF_ERROR(ReadNumber(frames));
    // Each number takes two characters at least: what the file can't hold is not allocated.
    const auto room = static_cast<int64_t>(text_.size());
    if (frames < 0 || frames > room || (channel_count_ > 0 && frames > room / channel_count_)) {
      return Error("a number of frames that the file holds");
    }
    STANCE_RETURN_IF_ERROR(Expect("Frame"));
    STANCE_RETURN_IF_ERROR(Expect("Time:"));
    STANCE_RETURN_IF_ERROR(ReadNumber(clip_.frame_time));
    clip_.frames.resize(frames, channel_count_);
    for (Eigen::Index i = 0; i < clip_.frames.size(); ++i) {
      STANCE_RETURN_IF_ERROR(ReadNumber(clip_.frames.data()[i]));
    }
    return Next().empty() ? absl::OkStatus() : Error("the end");
  }

  std::string_view text_;
  std::string_view word_;
  int line_ = 1;
  int channel_count_ = 0;
  BvhClip clip_;
};

}  // namespace

absl::StatusOr<BvhClip> ParseBvh(std::string_view text) { return BvhParser(text).Parse(); }

BvhPose PoseOfFrame(const BvhClip& clip, int frame) {
  STANCE_CHECK(frame >= 0 && frame < clip.frames.rows());
  BvhPose pose;
  pose.positions.resize(static_cast<Eigen::Index>(clip.joints.size()), 3);
  for (size_t j = 0; j < clip.joints.size(); ++j) {
    const BvhJoint& joint = clip.joints[j];
    Eigen::Vector3f translation = joint.offset;
    Rotation local = Rotation::Identity();
    for (size_t c = 0; c < joint.channels.size(); ++c) {
      const int kind = static_cast<int>(joint.channels[c]);
      const float value = clip.frames(frame, joint.first_channel + static_cast<Eigen::Index>(c));
      if (kind < 3) {
        translation[kind] += value;
      } else {
        local = local * Eigen::AngleAxisf(value * kRadiansPerDegree, Eigen::Vector3f::Unit(kind - 3));
      }
    }
    if (joint.parent < 0) {
      pose.rotations.push_back(local);
      pose.positions.row(0) = translation.transpose();
    } else {
      const Rotation parent = pose.rotations[joint.parent];  // a copy: the vector grows
      pose.rotations.push_back(parent * local);
      pose.positions.row(static_cast<Eigen::Index>(j)) =
          pose.positions.row(joint.parent) + (parent * translation).transpose();
    }
  }
  return pose;
}

}  // namespace stance

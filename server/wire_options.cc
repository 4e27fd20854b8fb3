#include "server/wire_options.h"

#include <fmt/format.h>

#include "server/status_map.h"

namespace stance {

absl::Status BadOption(const std::string& field, const std::string& description) {
  return FieldError(absl::StatusCode::kInvalidArgument, kInvalidOption, field, description);
}

absl::Status UnknownValue(const std::string& field, int value) {
  return BadOption(field, fmt::format("unknown value {}", value));
}

absl::StatusOr<std::optional<Method>> MethodFromWire(v1::Method method) {
  switch (method) {
    case v1::METHOD_UNSPECIFIED:
      return std::nullopt;
    case v1::METHOD_SKELETAL:
      return Method::kSkeletal;
    case v1::METHOD_STANCE:
      return Method::kStance;
    case v1::METHOD_NEURAL:
      return Method::kNeural;
    default:
      return UnknownValue("options.method", method);
  }
}

absl::StatusOr<SmoothingOptions> SmoothingFromWire(const v1::WeightSmoothing& wire) {
  SmoothingOptions options;
  switch (wire.kind()) {
    case v1::SMOOTHING_KIND_UNSPECIFIED:
    case v1::SMOOTHING_KIND_METRIC:
      options.kind = SmoothingKind::kMetric;
      break;
    case v1::SMOOTHING_KIND_HOPWISE:
      options.kind = SmoothingKind::kHopwise;
      break;
    case v1::SMOOTHING_KIND_NONE:
      options.kind = SmoothingKind::kNone;
      break;
    default:
      return UnknownValue("options.smoothing.kind", wire.kind());
  }
  if (wire.has_length()) {
    if (options.kind != SmoothingKind::kMetric) {
      return BadOption("options.smoothing.length", "belongs to SMOOTHING_KIND_METRIC only");
    }
    // Written so that a NaN is refused too.
    if (!(wire.length() > 0 && wire.length() <= 1)) {
      return BadOption("options.smoothing.length", fmt::format("{} is not in (0, 1]", wire.length()));
    }
    options.length = wire.length();
  }
  if (wire.has_lambda()) {
    if (options.kind != SmoothingKind::kHopwise) {
      return BadOption("options.smoothing.lambda", "belongs to SMOOTHING_KIND_HOPWISE only");
    }
    if (!(wire.lambda() > 0 && wire.lambda() <= 10000)) {
      return BadOption("options.smoothing.lambda", fmt::format("{} is not in (0, 10000]", wire.lambda()));
    }
    options.lambda = wire.lambda();
  }
  return options;
}

absl::StatusOr<Twist> TwistFromWire(v1::Twist twist) {
  switch (twist) {
    case v1::TWIST_UNSPECIFIED:
      return TransferOptions().twist;
    case v1::TWIST_SMALLEST:
      return Twist::kPaper;
    case v1::TWIST_INHERITED:
      return Twist::kInherited;
    default:
      return UnknownValue("options.twist", twist);
  }
}

absl::StatusOr<Facing> FacingFromWire(v1::Facing facing) {
  switch (facing) {
    case v1::FACING_UNSPECIFIED:
    case v1::FACING_REFERENCE:
      return Facing::kReference;
    case v1::FACING_SOURCE:
      return Facing::kSource;
    default:
      return UnknownValue("options.facing", facing);
  }
}

absl::StatusOr<Ground> GroundFromWire(v1::Ground ground) {
  switch (ground) {
    case v1::GROUND_UNSPECIFIED:
    case v1::GROUND_FREE:
      return Ground::kFree;
    case v1::GROUND_SOURCE:
      return Ground::kSource;
    default:
      return UnknownValue("options.ground", ground);
  }
}

absl::StatusOr<BoneNaming> BoneNamingFromWire(v1::BoneNaming naming) {
  switch (naming) {
    case v1::BONE_NAMING_UNSPECIFIED:
    case v1::BONE_NAMING_SMPL:
      return BoneNaming::kSmpl;
    case v1::BONE_NAMING_MIXAMO:
      return BoneNaming::kMixamo;
    case v1::BONE_NAMING_VRM:
      return BoneNaming::kVrm;
    case v1::BONE_NAMING_UNREAL:
      return BoneNaming::kUnreal;
    default:
      return UnknownValue("options.bone_naming", naming);
  }
}

absl::StatusOr<Priority> PriorityFromWire(v1::Priority priority) {
  switch (priority) {
    case v1::PRIORITY_BULK:
      return Priority::kBulk;
    case v1::PRIORITY_UNSPECIFIED:
    case v1::PRIORITY_NORMAL:
      return Priority::kNormal;
    case v1::PRIORITY_INTERACTIVE:
      return Priority::kInteractive;
    default:
      return UnknownValue("priority", priority);
  }
}

}  // namespace stance

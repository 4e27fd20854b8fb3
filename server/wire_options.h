// The values of a request's options as core's. Errors are FieldErrors (status_map.h).
#pragma once

#include <optional>
#include <string>

#include "core/base/status.h"
#include "core/skeleton/bone_names.h"
#include "core/transfer/options.h"
#include "server/batching/fair_queue.h"
#include "stance/v1/pose_transfer.pb.h"

namespace stance {

// The reason of the errors below (google.rpc.ErrorInfo).
inline constexpr char kInvalidOption[] = "INVALID_OPTION";

// INVALID_ARGUMENT: what is wrong with the option in the request's `field`.
absl::Status BadOption(const std::string& field, const std::string& description);
// INVALID_ARGUMENT: a number that the enumeration does not have in this version.
absl::Status UnknownValue(const std::string& field, int value);

// Nothing for unspecified.
absl::StatusOr<std::optional<Method>> MethodFromWire(v1::Method method);

// Unspecified and unset are core's defaults. INVALID_ARGUMENT for an unknown value, a number out of its
// range, and a parameter of another kind of smoothing.
absl::StatusOr<SmoothingOptions> SmoothingFromWire(const v1::WeightSmoothing& wire);
absl::StatusOr<Twist> TwistFromWire(v1::Twist twist);
absl::StatusOr<Facing> FacingFromWire(v1::Facing facing);
absl::StatusOr<Ground> GroundFromWire(v1::Ground ground);
absl::StatusOr<BoneNaming> BoneNamingFromWire(v1::BoneNaming naming);
absl::StatusOr<Priority> PriorityFromWire(v1::Priority priority);

}  // namespace stance

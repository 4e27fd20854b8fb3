#include "core/transfer/options.h"

#include <fmt/format.h>

#include "core/network/model_manifest.h"
#include "core/skeleton/skeleton.h"

namespace stance {

std::string MethodName(Method method) {
  switch (method) {
    case Method::kSkeletal:
      return kSkeletalMethod;
    case Method::kStance:
      return kStanceMethod;
    case Method::kNeural:
      return kNeuralMethod;
  }
  return "";
}

absl::StatusOr<Method> MethodFromName(const std::string& name) {
  for (const Method method : {Method::kSkeletal, Method::kStance, Method::kNeural}) {
    if (name == MethodName(method)) return method;
  }
  return absl::InvalidArgumentError(fmt::format("method '{}' is unknown; known: {}, {}, {}", name,
                                                kSkeletalMethod, kStanceMethod, kNeuralMethod));
}

absl::Status CheckOptions(const TransferOptions& options) {
  const SmoothingOptions& smoothing = options.smoothing;
  if (smoothing.kind == SmoothingKind::kMetric && !(smoothing.length > 0 && smoothing.length <= 1)) {
    return absl::InvalidArgumentError(
        fmt::format("smoothing.length: {} is not in (0, 1], a fraction of the stature", smoothing.length));
  }
  if (smoothing.kind == SmoothingKind::kHopwise && !(smoothing.lambda > 0 && smoothing.lambda <= 10'000)) {
    return absl::InvalidArgumentError(
        fmt::format("smoothing.lambda: {} is not in (0, 10000]", smoothing.lambda));
  }
  if (options.max_influences < 0 || options.max_influences > kHumanJoints) {
    return absl::InvalidArgumentError(
        fmt::format("max_influences: {} is not in 0..{}", options.max_influences, kHumanJoints));
  }
  return absl::OkStatus();
}

}  // namespace stance

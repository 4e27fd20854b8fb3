#include "core/training/evaluation_confidence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <mutex>
#include <numbers>
#include <numeric>

#include "core/base/check.h"
#include "core/base/threads.h"
#include "core/mesh/metrics.h"
#include "core/network/pose_model.h"
#include "core/training/evaluation.h"
#include "core/training/evaluation_pairs.h"
#include "core/transfer/confidence.h"

namespace stance {
namespace {

// Between two rotations, degrees.
double AngleDegrees(const Rotation& a, const Rotation& b) {
  const double cosine = ((a.cast<double>().transpose() * b.cast<double>()).trace() - 1) / 2;
  return std::acos(std::clamp(cosine, -1.0, 1.0)) * 180 / std::numbers::pi;
}

ConfidenceObservation Observe(const TransferPair& pair, const absl::StatusOr<TransferResult>& result) {
  ConfidenceObservation observation;
  if (!result.ok()) {
    observation.failure = result.status().ToString();
    return observation;
  }
  observation.mean_mm =
      VertexErrorsMm(result->target.positions, pair.truth).mean() * (kReferenceStature / pair.source.stature);
  observation.shares =
      JointShares(pair.source.mesh.positions, pair.source.mesh.faces, result->source_rig.weights);
  observation.confidence = {result->source_rig.confidence, result->reference_rig.confidence};
  observation.right = {RightJoints(result->source_rig, pair.source),
                       RightJoints(result->reference_rig, pair.reference)};
  return observation;
}

Eigen::VectorXf CalibratedConfidences(const Eigen::VectorXf& confidence,
                                      const ConfidenceCalibration& calibration) {
  return confidence.unaryExpr(
      [&](float p) { return static_cast<float>(CalibratedConfidence(p, calibration)); });
}

Claim TransferClaim(const ConfidenceObservation& one, const ConfidenceCalibration& calibration) {
  const auto stated = TransferConfidence(one.shares, CalibratedConfidences(one.confidence[0], calibration),
                                         CalibratedConfidences(one.confidence[1], calibration));
  const auto so = TransferConfidence(one.shares, one.right[0], one.right[1]);
  STANCE_CHECK(stated.has_value() && so.has_value());
  return {*stated, *so};
}

}  // namespace

Eigen::VectorXf RightJoints(const Rig& rig, const Character& truth) {
  STANCE_CHECK(rig.joints.rows() == truth.joints.rows() && rig.rotations.size() == truth.rotations.size());
  const Eigen::VectorXd distances =
      VertexErrorsMm(rig.joints, truth.joints) * (kReferenceStature / truth.stature);
  Eigen::VectorXf right(rig.joints.rows());
  for (Eigen::Index j = 0; j < right.size(); ++j) {
    const auto joint = static_cast<size_t>(j);
    right[j] = distances[j] < kRightMillimetres &&
                       AngleDegrees(rig.rotations[joint], truth.rotations[joint]) < kRightDegrees
                   ? 1.0f
                   : 0.0f;
  }
  return right;
}

absl::StatusOr<std::vector<ConfidenceObservation>> ObserveConfidence(
    const CharacterGenerator& generator, const Pipeline& pipeline, const ConfidenceEvaluationOptions& options,
    const std::function<void(int)>& progress) {
  const Method method = options.transfer.method.value_or(pipeline.models().front().method);
  if (method != Method::kStance) {
    return absl::FailedPreconditionError(
        fmt::format("method: '{}' does not know its confidence", MethodName(method)));
  }
  const int64_t count = static_cast<int64_t>(options.poses.size()) * options.pairs;
  std::vector<ConfidenceObservation> observations(static_cast<size_t>(count));
  std::mutex mutex;  // protects done
  int done = 0;
  ParallelFor(count, options.threads, 1, [&](int64_t begin, int64_t end) {
    for (int64_t item = begin; item < end; ++item) {
      CharacterOptions characters = options.characters;
      characters.poses = options.poses[static_cast<size_t>(item / options.pairs)];
      const TransferPair pair = generator.MakePair(options.seed, item % options.pairs, characters);
      ConfidenceObservation& one = observations[static_cast<size_t>(item)];
      one = Observe(pair, pipeline.Transfer(pair.source.mesh, pair.reference.mesh, options.transfer));
      one.poses = PoseMixName(characters.poses);
      one.index = item % options.pairs;
      const std::lock_guard<std::mutex> lock(mutex);
      if (progress) progress(++done);
    }
  });
  return observations;
}

std::vector<Claim> JointClaims(const std::vector<ConfidenceObservation>& observations, int joint) {
  std::vector<Claim> claims;
  for (const ConfidenceObservation& one : observations) {
    if (!one.failure.empty()) continue;
    for (size_t mesh = 0; mesh < one.right.size(); ++mesh) {
      claims.push_back({one.confidence[mesh][joint], one.right[mesh][joint]});
    }
  }
  return claims;
}

std::vector<Claim> JointClaims(const std::vector<ConfidenceObservation>& observations) {
  std::vector<Claim> claims;
  for (int joint = 0; joint < kHumanJoints; ++joint) {
    const std::vector<Claim> own = JointClaims(observations, joint);
    claims.insert(claims.end(), own.begin(), own.end());
  }
  return claims;
}

std::vector<Claim> TransferClaims(const std::vector<ConfidenceObservation>& observations,
                                  const ConfidenceCalibration& calibration) {
  std::vector<Claim> claims;
  for (const ConfidenceObservation& one : observations) {
    if (one.failure.empty()) claims.push_back(TransferClaim(one, calibration));
  }
  return claims;
}

std::vector<KeptTransfers> KeptAbove(const std::vector<ConfidenceObservation>& observations,
                                     const std::vector<double>& thresholds,
                                     const ConfidenceCalibration& calibration) {
  std::vector<std::pair<double, double>> made;  // confidence, error
  for (const ConfidenceObservation& one : observations) {
    if (one.failure.empty()) made.emplace_back(TransferClaim(one, calibration).probability, one.mean_mm);
  }
  std::vector<KeptTransfers> table;
  for (const double least : thresholds) {
    std::vector<double> errors;
    for (const auto& [confidence, mean_mm] : made) {
      if (confidence >= least) errors.push_back(mean_mm);
    }
    KeptTransfers kept{.least = least};
    if (!errors.empty()) {
      const auto count = static_cast<double>(errors.size());
      kept.share = count / static_cast<double>(made.size());
      kept.mean_mm = std::accumulate(errors.begin(), errors.end(), 0.0) / count;
      kept.p95_mm = Quantile(errors, 0.95);
      kept.worst_mm = *std::max_element(errors.begin(), errors.end());
    }
    table.push_back(kept);
  }
  return table;
}

}  // namespace stance

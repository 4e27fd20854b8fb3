#include "core/training/pose_samples.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/skeleton/mirror.h"
#include "core/training/pose_sampler.h"
#include "core/transfer/pose_estimation.h"
#include "core/transfer/pose_refinement.h"
#include "core/transfer/pose_views.h"

namespace stance {
namespace {

// The generator's characters stand.
constexpr PoseEstimationOptions kFirstLook = {.views = 4, .refinement_views = 0, .least_confidence = 0};

torch::Tensor Tensor(const RowMatrix& matrix) {
  return torch::from_blob(const_cast<float*>(matrix.data()), {matrix.rows(), matrix.cols()}).clone();
}

torch::Tensor Tensor(const std::vector<Rotation>& rotations) {
  auto tensor = torch::empty({std::ssize(rotations), 3, 3});
  auto access = tensor.accessor<float, 3>();
  for (int64_t j = 0; j < tensor.size(0); ++j) {
    for (int r = 0; r < 3; ++r) {
      for (int c = 0; c < 3; ++c) access[j][r][c] = rotations[j](r, c);
    }
  }
  return tensor;
}

PosedBatch StackPosed(const std::vector<PoseSample>& samples, const std::vector<PoseSample>& unposed) {
  std::vector<torch::Tensor> points, joints, rotations, turns, shifts;
  for (size_t i = 0; i < samples.size(); ++i) {
    const Normalization normalization = NormalizationOf(unposed[i].input.points);
    const float unit = 1 / normalization.scale;
    points.push_back(Tensor(RowMatrix(samples[i].input.points * unit)));
    joints.push_back(Tensor(RowMatrix(samples[i].joints * unit)));
    rotations.push_back(Tensor(samples[i].rotations));
    turns.push_back(Tensor(samples[i].first->rotations));
    const std::vector<AffineTransform> again = PoseAgain(*samples[i].first);
    Points center(kHumanJoints, 3);
    for (int j = 0; j < kHumanJoints; ++j) {
      center.row(j) = again[j].Apply(normalization.center.transpose()).transpose();
    }
    shifts.push_back(Tensor(RowMatrix(center * unit)));
  }
  return {torch::cat(points), torch::stack(joints), torch::stack(rotations), torch::stack(turns),
          torch::stack(shifts)};
}

// Each sample as the network sees it; as it stands, too, where they are unposed.
PoseBatch Stack(const std::vector<PoseSample>& samples) {
  std::vector<PoseSample> unposed;
  for (const PoseSample& sample : samples) {
    if (sample.first) unposed.push_back(Unposed(sample));
  }
  const std::vector<PoseSample>& seen = unposed.empty() ? samples : unposed;
  std::vector<const PyramidInput*> inputs;
  std::vector<torch::Tensor> weights, canonical, joints, bones, rotations;
  for (const PoseSample& sample : seen) {
    inputs.push_back(&sample.input);
    weights.push_back(Tensor(sample.weights));
    canonical.push_back(Tensor(RowMatrix(sample.canonical)));
    const Normalization normalization = NormalizationOf(sample.input.points);
    joints.push_back(Tensor(RowMatrix(normalization.Apply(sample.joints))));
    bones.push_back(Tensor(RowMatrix(sample.bones / normalization.scale)));
    rotations.push_back(Tensor(sample.rotations));
  }
  PoseBatch batch{StackPyramids(inputs), torch::cat(weights), torch::cat(canonical),
                  torch::stack(joints),  torch::stack(bones), torch::stack(rotations)};
  if (!unposed.empty()) batch.posed = StackPosed(samples, unposed);
  return batch;
}

}  // namespace

PoseSample Mirrored(const PoseSample& sample) {
  PoseSample mirrored = sample;
  for (Points* points : {&mirrored.input.points, &mirrored.input.normals, &mirrored.canonical}) {
    points->col(0) *= -1;
  }
  mirrored.weights = MirroredWeights(sample.weights);
  mirrored.joints = MirroredJoints(sample.joints);
  mirrored.bones = MirroredJoints(sample.bones);
  mirrored.rotations = MirroredRotations(sample.rotations);
  if (sample.first) mirrored.first = EstimateBehindView(*sample.first, {.mirrored = true});
  return mirrored;
}

PoseSample Turned(PoseSample sample, const Rotation& turn) {
  for (Points* points : {&sample.input.points, &sample.input.normals, &sample.joints}) {
    *points = (*points * turn.transpose()).eval();
  }
  for (Rotation& rotation : sample.rotations) rotation = turn * rotation;
  return sample;
}

PoseSample Unposed(const PoseSample& sample) {
  STANCE_CHECK(sample.first.has_value());
  const PoseEstimate& first = *sample.first;
  PoseSample unposed = sample;
  unposed.input = UnposedInput(sample.input, first);
  const std::vector<AffineTransform> again = PoseAgain(first);
  for (int j = 0; j < kHumanJoints; ++j) {
    unposed.joints.row(j) = (sample.joints.row(j) - again[j].translation.transpose()) * again[j].linear;
    unposed.rotations[j] = again[j].linear.transpose() * sample.rotations[j];
  }
  unposed.first.reset();
  return unposed;
}

PoseEstimate Perturbed(PoseEstimate estimate, Random& random) {
  constexpr double kMostRadians = 0.06, kMostMetres = 0.006;
  const double radians = random.Uniform(0, kMostRadians), metres = random.Uniform(0, kMostMetres);
  const auto vector = [&random](double deviation) {
    const auto normal = [&] { return static_cast<float>(deviation * random.Normal()); };
    const float x = normal(), y = normal(), z = normal();
    return Eigen::Vector3f(x, y, z);
  };
  for (int j = 0; j < kHumanJoints; ++j) {
    const Eigen::Vector3f turn = vector(radians);
    estimate.rotations[j] = Eigen::AngleAxisf(turn.norm(), turn.stableNormalized()) * estimate.rotations[j];
    estimate.joints.row(j) += vector(metres).transpose();
  }
  return estimate;
}

Rotation TrainingTurn(Random& random) {
  constexpr double kAnyTurn = 0.15;
  if (!random.Chance(kAnyTurn)) return SampleGlobalTurn(random);
  const auto normal = [&random] { return static_cast<float>(random.Normal()); };
  const float w = normal(), x = normal(), y = normal(), z = normal();
  return Eigen::Quaternionf(w, x, y, z).normalized().toRotationMatrix();
}

PoseStream::PoseStream(const CharacterGenerator& generator, const SampleOptions& options, int64_t reuse,
                       const PoseModel* first)
    : generator_(generator),
      options_(options),
      first_(first),
      characters_(reuse, [this](int64_t character) { return MakeSample(character); }) {}

PoseSample PoseStream::MakeSample(int64_t index) const {
  const Character character = MakeTrainingCharacter(generator_, options_, index);
  const SurfaceSamples surface = ResampleSurface(character.mesh, {options_.samples, options_.max_ring});
  PoseSample sample = {MakePyramidInput(surface, /*threads=*/1, options_.features),
                       ValuesAt(character.weights, surface.place),
                       ValuesAt(character.canonical, surface.place),
                       character.joints,
                       BoneVectors(HumanSkeleton(), character.rest_joints),
                       character.rotations};
  if (first_) {
    const Samplings seen = {sample.input};
    const auto found = EstimatePoses(*first_, {&seen, 1}, /*threads=*/1, kFirstLook);
    STANCE_CHECK(found.ok());
    sample.first = (*found)[0];
  }
  return sample;
}

PoseSample PoseStream::At(int64_t index) {
  Random random(options_.seed ^ 0x3c6e'f372ULL, static_cast<uint64_t>(index));
  const std::shared_ptr<const PoseSample> sample = characters_.At(index, random);
  const bool mirror = random.Chance(0.5);
  PoseSample seen = mirror ? Mirrored(*sample) : *sample;
  if (!seen.first) return Turned(std::move(seen), TrainingTurn(random));
  seen.first = Perturbed(std::move(*seen.first), random);
  return seen;
}

PoseBatch PoseStream::MakeBatch(int64_t first, int64_t size) {
  std::vector<PoseSample> samples;
  for (int64_t i = 0; i < size; ++i) samples.push_back(At(first + i));
  return Stack(samples);
}

PoseBatch PoseBatch::To(torch::Device device) const {
  PoseBatch moved = *this;
  moved.input = input.To(device);
  for (torch::Tensor* tensor :
       {&moved.weights, &moved.canonical, &moved.joints, &moved.bones, &moved.rotations}) {
    *tensor = tensor->to(device);
  }
  if (moved.posed) {
    PosedBatch& own = *moved.posed;
    for (torch::Tensor* tensor : {&own.points, &own.joints, &own.rotations, &own.turns, &own.shifts}) {
      *tensor = tensor->to(device);
    }
  }
  return moved;
}

}  // namespace stance

#include "core/training/pose_samples.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <utility>

#include "core/base/check.h"
#include "core/skeleton/mirror.h"
#include "core/training/pose_sampler.h"

namespace stance {
namespace {

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

PoseSample MakeSample(const CharacterGenerator& generator, const SampleOptions& options, int64_t index) {
  const Character character = MakeTrainingCharacter(generator, options, index);
  const SurfaceSamples surface = ResampleSurface(character.mesh, {options.samples, options.max_ring});
  return {MakePyramidInput(surface, /*threads=*/1),
          ValuesAt(character.weights, surface.place),
          ValuesAt(character.canonical, surface.place),
          character.joints,
          BoneVectors(HumanSkeleton(), character.rest_joints),
          character.rotations};
}

PoseBatch Stack(const std::vector<PoseSample>& samples) {
  std::vector<const PyramidInput*> inputs;
  std::vector<torch::Tensor> weights, canonical, joints, bones, rotations;
  for (const PoseSample& sample : samples) {
    inputs.push_back(&sample.input);
    weights.push_back(Tensor(sample.weights));
    canonical.push_back(Tensor(RowMatrix(sample.canonical)));
    const Normalization normalization = NormalizationOf(sample.input.points);
    joints.push_back(Tensor(RowMatrix(normalization.Apply(sample.joints))));
    bones.push_back(Tensor(RowMatrix(sample.bones / normalization.scale)));
    rotations.push_back(Tensor(sample.rotations));
  }
  return {StackPyramids(inputs), torch::cat(weights), torch::cat(canonical),
          torch::stack(joints),  torch::stack(bones), torch::stack(rotations)};
}

}  // namespace

PoseSample Mirrored(const PoseSample& sample) {
  PoseSample mirrored = sample;
  for (Points* points : {&mirrored.input.points, &mirrored.input.normals, &mirrored.canonical}) {
    points->col(0) *= -1;
  }
  for (int j = 0; j < kHumanJoints; ++j) mirrored.weights.col(j) = sample.weights.col(MirrorJoint(j));
  mirrored.joints = MirroredJoints(sample.joints);
  mirrored.bones = MirroredJoints(sample.bones);
  mirrored.rotations = MirroredRotations(sample.rotations);
  return mirrored;
}

PoseSample Turned(PoseSample sample, const Rotation& turn) {
  for (Points* points : {&sample.input.points, &sample.input.normals, &sample.joints}) {
    *points = (*points * turn.transpose()).eval();
  }
  for (Rotation& rotation : sample.rotations) rotation = turn * rotation;
  return sample;
}

Rotation TrainingTurn(Random& random) {
  constexpr double kAnyTurn = 0.15;
  if (!random.Chance(kAnyTurn)) return SampleGlobalTurn(random);
  const auto normal = [&random] { return static_cast<float>(random.Normal()); };
  const float w = normal(), x = normal(), y = normal(), z = normal();
  return Eigen::Quaternionf(w, x, y, z).normalized().toRotationMatrix();
}

PoseStream::PoseStream(const CharacterGenerator& generator, const SampleOptions& options, int64_t reuse)
    : generator_(generator), options_(options), reuse_(reuse), window_(kWindow) {
  STANCE_CHECK(reuse >= 1);
}

std::shared_ptr<const PoseSample> PoseStream::CharacterAt(int64_t index) {
  Slot& slot = window_[index % kWindow];
  {
    const std::lock_guard lock(mutex_);
    if (slot.character == index) return slot.sample;
  }
  auto sample = std::make_shared<const PoseSample>(MakeSample(generator_, options_, index));
  const std::lock_guard lock(mutex_);
  if (slot.character < index) slot = {index, sample};
  return sample;
}

PoseSample PoseStream::At(int64_t index) {
  Random random(options_.seed ^ 0x3c6e'f372ULL, static_cast<uint64_t>(index));
  int64_t character = index / reuse_;
  if (index % reuse_ != 0) character -= random.Below(std::min(character + 1, kWindow));
  const std::shared_ptr<const PoseSample> sample = CharacterAt(character);
  const bool mirror = random.Chance(0.5);
  return Turned(mirror ? Mirrored(*sample) : *sample, TrainingTurn(random));
}

PoseBatch PoseStream::MakeBatch(int64_t first, int64_t size) {
  std::vector<PoseSample> samples;
  for (int64_t i = 0; i < size; ++i) samples.push_back(At(first + i));
  return Stack(samples);
}

PoseBatch PoseBatch::To(torch::Device device) const {
  return {input.To(device),  weights.to(device), canonical.to(device),
          joints.to(device), bones.to(device),   rotations.to(device)};
}

}  // namespace stance

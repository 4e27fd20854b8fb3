#include "core/training/sample_stream.h"

#include <cstring>

namespace stance {
namespace {

constexpr double kHoledShare = 0.1;  // of the augmented characters
constexpr int kMostHoles = 3;

struct Sample {
  NetworkInput input;
  std::vector<int32_t> joint_of;  // per point
  Points joints;                  // metres
};

Sample MakeSample(const CharacterGenerator& generator, const SampleOptions& options, int64_t index) {
  const Character character = MakeTrainingCharacter(generator, options, index);
  SurfaceSamples surface = ResampleSurface(character.mesh, {options.samples, options.max_ring});
  Sample sample;
  sample.joint_of = LabelsOfSamples(character, surface);
  sample.joints = character.joints;
  sample.input = {std::move(surface.points), std::move(surface.one_ring)};
  return sample;
}

}  // namespace

CharacterOptions TrainingCharacterOptions(const SampleOptions& options, int64_t index) {
  Random random(options.seed ^ 0x5a17'9d3fULL, static_cast<uint64_t>(index));
  CharacterOptions character_options;
  character_options.split = options.split;
  character_options.poses = options.poses;
  character_options.global_rotation = options.turn;
  character_options.rigged_share = options.rigged_share;
  if (options.augment) {
    character_options.vertices = -1;
    character_options.anisotropic_scale = true;
    // Metres along the normal; paper A trains with +-1.5 cm throughout, which drowns the hands.
    const double noise[] = {0.0, 0.0, 0.002, 0.005, 0.015};
    character_options.noise = noise[random.Below(5)];
    if (random.Chance(kHoledShare)) character_options.holes = 1 + static_cast<int>(random.Below(kMostHoles));
  }
  return character_options;
}

Character MakeTrainingCharacter(const CharacterGenerator& generator, const SampleOptions& options,
                                int64_t index) {
  return generator.Make(options.seed, index, TrainingCharacterOptions(options, index));
}

std::vector<int32_t> LabelsOfSamples(const Character& character, const SurfaceSamples& samples) {
  const RowMatrix weights = ValuesAt(character.weights, samples.place);
  std::vector<int32_t> labels;
  labels.reserve(samples.place.size());
  for (Eigen::Index s = 0; s < weights.rows(); ++s) {
    Eigen::Index joint;
    weights.row(s).maxCoeff(&joint);
    labels.push_back(static_cast<int32_t>(joint));
  }
  return labels;
}

TrainingBatch TrainingBatch::To(torch::Device device) const {
  TrainingBatch moved = *this;
  for (torch::Tensor* tensor :
       {&moved.input.points, &moved.input.one_ring, &moved.input.knn, &moved.joint_of, &moved.joints}) {
    *tensor = tensor->to(device);
  }
  return moved;
}

TrainingBatch MakeTrainingBatch(const CharacterGenerator& generator, const SampleOptions& options,
                                int64_t first, int64_t size) {
  std::vector<Sample> samples;
  std::vector<const NetworkInput*> inputs;
  for (int64_t i = 0; i < size; ++i) samples.push_back(MakeSample(generator, options, first + i));
  for (const Sample& sample : samples) inputs.push_back(&sample.input);
  TrainingBatch batch;
  batch.input = StackInputs(inputs);
  AddSpatialNeighbors(batch.input);
  batch.joint_of = torch::empty({batch.input.offsets.back()}, torch::kInt64);
  batch.joints = torch::empty({size, kHumanJoints, 3});
  auto label = batch.joint_of.accessor<int64_t, 1>();
  for (int64_t i = 0; i < size; ++i) {
    for (size_t p = 0; p < samples[i].joint_of.size(); ++p) {
      label[batch.input.offsets[i] + static_cast<int64_t>(p)] = samples[i].joint_of[p];
    }
    const Points joints = NormalizationOf(samples[i].input.points).Apply(samples[i].joints);
    std::memcpy(batch.joints[i].data_ptr<float>(), joints.data(), joints.size() * sizeof(float));
  }
  return batch;
}

}  // namespace stance

#include "core/training/sample_stream.h"

#include <ATen/Parallel.h>

#include <condition_variable>
#include <cstring>
#include <map>
#include <mutex>
#include <thread>

namespace stance {
namespace {

struct Sample {
  NetworkInput input;
  std::vector<int32_t> joint_of;  // per point
  Points joints;                  // metres
};

Sample MakeSample(const CharacterGenerator& generator, const SampleOptions& options, int64_t index) {
  Random random(options.seed ^ 0x5a17'9d3fULL, static_cast<uint64_t>(index));
  CharacterOptions character_options;
  character_options.split = options.split;
  character_options.poses = options.poses;
  if (options.augment) {
    character_options.vertices = -1;
    character_options.anisotropic_scale = true;
    // Metres along the normal; paper A trains with +-1.5 cm throughout, which drowns the hands.
    const double noise[] = {0.0, 0.0, 0.002, 0.005, 0.015};
    character_options.noise = noise[random.Below(5)];
  }
  const Character character = generator.Make(options.seed, index, character_options);
  SurfaceSamples surface = ResampleSurface(character.mesh, {options.samples, options.max_ring});
  Sample sample;
  sample.joint_of = LabelsOfSamples(character, surface);
  sample.joints = character.joints;
  sample.input = {std::move(surface.points), std::move(surface.one_ring)};
  return sample;
}

}  // namespace

std::vector<int32_t> LabelsOfSamples(const Character& character, const SurfaceSamples& samples) {
  std::vector<int32_t> labels;
  labels.reserve(samples.vertex.size());
  for (const int32_t v : samples.vertex) {
    Eigen::Index joint;
    character.weights.row(v).maxCoeff(&joint);
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

struct SampleStream::State {
  const CharacterGenerator& generator;
  const SampleOptions options;
  const int64_t batch_size;
  std::mutex mutex;
  std::condition_variable changed;
  int64_t next_to_make;                    // index of the first character of the next batch to make
  int64_t next_to_give;                    // likewise, to give
  std::map<int64_t, TrainingBatch> ready;  // by first index
  bool stop = false;
  std::vector<std::jthread> threads;
};

SampleStream::SampleStream(const CharacterGenerator& generator, const SampleOptions& options, int64_t first,
                           int64_t batch_size, int threads)
    : state_(new State{generator, options, batch_size, {}, {}, first, first, {}, false, {}}) {
  for (int t = 0; t < threads; ++t) {
    state_->threads.emplace_back([this, ahead = 3 * threads] {
      at::set_num_threads(1);
      State& s = *state_;
      std::unique_lock lock(s.mutex);
      while (true) {
        s.changed.wait(lock,
                       [&] { return s.stop || s.next_to_make < s.next_to_give + ahead * s.batch_size; });
        if (s.stop) return;
        const int64_t begin = s.next_to_make;
        s.next_to_make += s.batch_size;
        lock.unlock();
        TrainingBatch batch = MakeTrainingBatch(s.generator, s.options, begin, s.batch_size);
        lock.lock();
        s.ready.emplace(begin, std::move(batch));
        s.changed.notify_all();
      }
    });
  }
}

SampleStream::~SampleStream() {
  {
    const std::lock_guard lock(state_->mutex);
    state_->stop = true;
  }
  state_->changed.notify_all();
  state_->threads.clear();  // joins
}

TrainingBatch SampleStream::Next() {
  State& s = *state_;
  std::unique_lock lock(s.mutex);
  s.changed.wait(lock, [&] { return s.ready.contains(s.next_to_give); });
  TrainingBatch batch = std::move(s.ready.extract(s.next_to_give).mapped());
  s.next_to_give += s.batch_size;
  s.changed.notify_all();
  return batch;
}

}  // namespace stance

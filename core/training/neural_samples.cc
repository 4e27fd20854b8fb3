#include "core/training/neural_samples.h"

#include <utility>
#include <vector>

namespace stance {
namespace {

struct Side {
  NetworkInput input;
  RowMatrix weights;  // (N, 24)
  Points joints;      // metres
};

struct Pair {
  Side source, reference;
  Points target;  // (N of the source, 3) metres
};

torch::Tensor Tensor(const RowMatrix& matrix) {
  auto tensor = torch::empty({matrix.rows(), matrix.cols()});
  Eigen::Map<RowMatrix>(tensor.data_ptr<float>(), matrix.rows(), matrix.cols()) = matrix;
  return tensor;
}

Side SideOf(const Character& character, const SurfaceSamples& surface) {
  return {{surface.points, surface.one_ring}, ValuesAt(character.weights, surface.place), character.joints};
}

Pair MakePair(const CharacterGenerator& generator, const SampleOptions& options, int64_t index) {
  CharacterOptions characters = TrainingCharacterOptions(options, index);
  // As the paper does. Neither the samples, but for exact ties, nor the networks' answers change with it.
  characters.shuffle_vertices = true;
  const TransferPair pair = generator.MakePair(options.seed, index, characters);
  const ResampleOptions resample{options.samples, options.max_ring};
  SurfaceSamples source = ResampleSurface(pair.source.mesh, resample);
  Points target = ValuesAt(pair.truth, source.place);
  Random random(options.seed ^ 0x9b05'688cULL, static_cast<uint64_t>(index));
  for (int64_t i = 0; characters.noise > 0 && i < source.points.rows(); ++i) {
    source.points.row(i) +=
        static_cast<float>(random.Uniform(-characters.noise, characters.noise)) * source.normals.row(i);
  }
  return {SideOf(pair.source, source), SideOf(pair.reference, ResampleSurface(pair.reference.mesh, resample)),
          std::move(target)};
}

torch::Tensor EdgesOf(const std::vector<Pair>& pairs, const std::vector<int64_t>& offsets) {
  std::vector<int64_t> rows;
  for (size_t i = 0; i < pairs.size(); ++i) {
    const NeighborTable& ring = pairs[i].source.input.one_ring;
    for (int64_t v = 0; v < ring.rows(); ++v) {
      for (int64_t k = 0; k < ring.cols(); ++k) {
        if (ring(v, k) > v) rows.insert(rows.end(), {offsets[i] + v, offsets[i] + ring(v, k)});
      }
    }
  }
  return torch::tensor(rows, torch::kInt64).reshape({-1, 2});
}

}  // namespace

NeuralBatch NeuralBatch::To(torch::Device device) const {
  NeuralBatch moved = *this;
  for (torch::Tensor* tensor : {&moved.input.points, &moved.input.one_ring, &moved.input.knn, &moved.weights,
                                &moved.joints, &moved.target, &moved.edges}) {
    *tensor = tensor->to(device);
  }
  return moved;
}

NeuralBatch MakeNeuralBatch(const CharacterGenerator& generator, const SampleOptions& options, int64_t first,
                            int64_t size) {
  std::vector<Pair> pairs;
  for (int64_t i = 0; i < size; ++i) pairs.push_back(MakePair(generator, options, first + i));
  std::vector<const NetworkInput*> inputs;
  std::vector<torch::Tensor> weights, joints, targets;
  for (const bool reference : {false, true}) {
    for (const Pair& pair : pairs) {
      const Side& side = reference ? pair.reference : pair.source;
      const Normalization normalization = NormalizationOf(side.input.points);
      inputs.push_back(&side.input);
      weights.push_back(Tensor(side.weights));
      joints.push_back(Tensor(normalization.Apply(side.joints)));
      if (!reference) targets.push_back(Tensor(normalization.Apply(pair.target)));
    }
  }
  NeuralBatch batch;
  batch.input = StackInputs(inputs);
  AddSpatialNeighbors(batch.input);
  batch.weights = torch::cat(weights);
  batch.joints = torch::stack(joints);
  batch.target = torch::cat(targets);
  batch.edges = EdgesOf(pairs, batch.input.offsets);
  return batch;
}

}  // namespace stance

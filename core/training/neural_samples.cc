#include "core/training/neural_samples.h"

#include <utility>
#include <vector>

#include "core/skeleton/mirror.h"
#include "core/training/pose_sampler.h"

namespace stance {
namespace {

torch::Tensor Tensor(const RowMatrix& matrix) {
  auto tensor = torch::empty({matrix.rows(), matrix.cols()});
  Eigen::Map<RowMatrix>(tensor.data_ptr<float>(), matrix.rows(), matrix.cols()) = matrix;
  return tensor;
}

PairSide SideOf(const Character& character, const SurfaceSamples& surface) {
  return {{surface.points, surface.one_ring}, ValuesAt(character.weights, surface.place), character.joints};
}

void Mirror(PairSide& side) {
  side.input.points.col(0) *= -1;
  side.joints = MirroredJoints(side.joints);
  side.weights = MirroredWeights(side.weights);
}

void Turn(PairSide& side, const Rotation& turn) {
  side.input.points = (side.input.points * turn.transpose()).eval();
  side.joints = (side.joints * turn.transpose()).eval();
}

torch::Tensor EdgesOf(const std::vector<NeuralPair>& pairs, const std::vector<int64_t>& offsets) {
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

NeuralPair Mirrored(const NeuralPair& pair) {
  NeuralPair mirrored = pair;
  Mirror(mirrored.source);
  Mirror(mirrored.reference);
  mirrored.target.col(0) *= -1;
  return mirrored;
}

NeuralPair Turned(NeuralPair pair, const Rotation& source, const Rotation& reference) {
  const Eigen::RowVector3f before = pair.source.joints.row(kPelvis);
  Turn(pair.source, source);
  Turn(pair.reference, reference);
  pair.target =
      ((pair.target.rowwise() - before) * reference.transpose()).rowwise() + pair.source.joints.row(kPelvis);
  return pair;
}

PairStream::PairStream(const CharacterGenerator& generator, const SampleOptions& options, int64_t reuse)
    : generator_(generator),
      options_(options),
      reuse_(reuse),
      pairs_(reuse, [this](int64_t number) { return MakePair(number); }) {}

NeuralPair PairStream::MakePair(int64_t number) const {
  CharacterOptions characters = TrainingCharacterOptions(options_, number);
  // As the paper does. Neither the samples, but for exact ties, nor the networks' answers change with it.
  characters.shuffle_vertices = true;
  const TransferPair pair = generator_.MakePair(options_.seed, number, characters);
  const ResampleOptions resample{options_.samples, options_.max_ring};
  SurfaceSamples source = ResampleSurface(pair.source.mesh, resample);
  Points target = ValuesAt(pair.truth, source.place);
  Random random(options_.seed ^ 0x9b05'688cULL, static_cast<uint64_t>(number));
  for (int64_t i = 0; characters.noise > 0 && i < source.points.rows(); ++i) {
    source.points.row(i) +=
        static_cast<float>(random.Uniform(-characters.noise, characters.noise)) * source.normals.row(i);
  }
  return {SideOf(pair.source, source), SideOf(pair.reference, ResampleSurface(pair.reference.mesh, resample)),
          std::move(target)};
}

NeuralPair PairStream::At(int64_t index) {
  Random random(options_.seed ^ 0x1f83'd9abULL, static_cast<uint64_t>(index));
  const std::shared_ptr<const NeuralPair> pair = pairs_.At(index, random);
  if (reuse_ == 1) return *pair;
  NeuralPair changed = random.Chance(0.5) ? Mirrored(*pair) : *pair;
  const Rotation source = SampleGlobalTurn(random), reference = SampleGlobalTurn(random);
  return Turned(std::move(changed), source, reference);
}

NeuralBatch PairStream::MakeBatch(int64_t first, int64_t size) {
  std::vector<NeuralPair> pairs;
  for (int64_t i = 0; i < size; ++i) pairs.push_back(At(first + i));
  std::vector<const NetworkInput*> inputs;
  std::vector<torch::Tensor> weights, joints, targets;
  for (const bool reference : {false, true}) {
    for (const NeuralPair& pair : pairs) {
      const PairSide& side = reference ? pair.reference : pair.source;
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

#include "core/training/pose_samples.h"

#include <vector>

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

}  // namespace

PoseBatch MakePoseBatch(const CharacterGenerator& generator, const SampleOptions& options, int64_t first,
                        int64_t size) {
  std::vector<PyramidInput> inputs;
  std::vector<torch::Tensor> weights, canonical, joints, rotations;
  for (int64_t i = 0; i < size; ++i) {
    const Character character = MakeTrainingCharacter(generator, options, first + i);
    const SurfaceSamples surface = ResampleSurface(character.mesh, {options.samples, options.max_ring});
    inputs.push_back(MakePyramidInput(surface, /*threads=*/1));
    weights.push_back(Tensor(ValuesAt(character.weights, surface.place)));
    canonical.push_back(Tensor(ValuesAt(character.canonical, surface.place)));
    joints.push_back(Tensor(RowMatrix(NormalizationOf(surface.points).Apply(character.joints))));
    rotations.push_back(Tensor(character.rotations));
  }
  std::vector<const PyramidInput*> pointers;
  for (const PyramidInput& input : inputs) pointers.push_back(&input);
  return {StackPyramids(pointers), torch::cat(weights), torch::cat(canonical), torch::stack(joints),
          torch::stack(rotations)};
}

PoseBatch PoseBatch::To(torch::Device device) const {
  return {input.To(device), weights.to(device), canonical.to(device), joints.to(device),
          rotations.to(device)};
}

}  // namespace stance

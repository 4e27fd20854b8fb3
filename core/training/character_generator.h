// Random characters with ground truth, from MakeHuman's CC0 parametric body (MPFB), rigged characters and CMU
// motion capture.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "core/base/random.h"
#include "core/base/status.h"
#include "core/training/character.h"

namespace stance {

enum class PoseMix {
  kModerate,  // natural ranges and CMU frames
  kHard,      // wide ranges, limbs in contact, legs together
  kTraining,  // both, and rest-like poses (T, A, arms down, legs together)
};

// Identities and poses of different splits never coincide: each draws from its own streams of seeds, and the
// CMU clips are divided among them. Held-out rigged characters are for test, the others for training;
// validation has none.
enum class Split { kTrain, kValidation, kTest };

struct CharacterOptions {
  PoseMix poses = PoseMix::kTraining;
  Split split = Split::kTrain;
  // Vertices of the mesh: 0 for the full body (13,380), else a decimation of about that many; -1 picks one of
  // the levels at random for each character.
  int vertices = 0;
  bool global_rotation = true;     // yaw over the full circle and a moderate tilt
  bool anisotropic_scale = false;  // per-limb scales on 60 % of the characters
  bool shuffle_vertices = false;
  double noise = 0.0;       // metres, uniform +- along the normals
  double rigged_share = 0;  // probability that the identity is one of the split's rigged characters, which
                            // have one resolution each
  int holes = 0;            // balls whose faces are cut out (holes.h)
};

// Thread-safe: const calls may run at the same time.
class CharacterGenerator {
 public:
  // Builds the body model from a folder with MPFB's data (3dobjs/, targets/, rigs/) and a folder of BVH
  // clips. The reading takes seconds: write a pack once, then open that.
  static absl::StatusOr<std::unique_ptr<CharacterGenerator>> FromData(const std::filesystem::path& mpfb_dir,
                                                                      const std::filesystem::path& bvh_dir);

  // One compact file (16-bit morph basis, weights, joint regressors, CMU poses; under 30 MB) that
  // holds all a generator needs. DATA_LOSS with the path for a damaged one.
  static absl::StatusOr<std::unique_ptr<CharacterGenerator>> FromPack(const std::filesystem::path& pack);
  absl::Status WritePack(const std::filesystem::path& pack) const;

  // Adds the rigged characters of a folder (rigged_folder.h), before any other call. A line for each file
  // that is none: its path and why not.
  absl::StatusOr<std::vector<std::string>> AddRigged(const std::filesystem::path& folder);

  // INVALID_ARGUMENT for options that name what there is not. The calls below REQUIRE options that pass.
  absl::Status Check(const CharacterOptions& options) const;

  // "rocketbox/Male_Adult_01", ...: the split's rigged characters.
  std::vector<std::string> RiggedNames(Split split) const;

  ~CharacterGenerator();

  // The index-th character of the stream `seed`: the same arguments give the same character, in any order and
  // on any thread.
  Character Make(uint64_t seed, int64_t index, const CharacterOptions& options) const;

  // The index-th transfer pair. Both characters have options' pose mix; noise applies to the reference only.
  TransferPair MakePair(uint64_t seed, int64_t index, const CharacterOptions& options) const;

  // `count` poses of one identity (paper A's table 1).
  std::vector<Character> MakePoses(uint64_t seed, int64_t index, int count,
                                   const CharacterOptions& options) const;

  // The neutral body in the rest (T) pose.
  Character Neutral(int vertices = 0) const;

 private:
  struct Model;
  explicit CharacterGenerator(std::unique_ptr<Model> model);
  std::unique_ptr<Model> model_;
};

}  // namespace stance

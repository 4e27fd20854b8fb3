#include "core/training/character_generator.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <numeric>
#include <optional>
#include <utility>

#include "core/base/check.h"
#include "core/base/files.h"
#include "core/mesh/measure.h"
#include "core/training/body_model.h"
#include "core/training/character_pack.h"
#include "core/training/holes.h"
#include "core/training/limb_style.h"
#include "core/training/motion_library.h"
#include "core/training/mpfb_body.h"
#include "core/training/pose_sampler.h"
#include "core/training/rigged_folder.h"
#include "core/training/skinning.h"

namespace stance {
namespace {

constexpr double kStyledShare = 0.6;  // of the characters, where anisotropic scales are asked for

// What a stream of random numbers decides. A pair's reference draws from the second half.
enum Purpose : uint64_t { kIdentity, kPose, kTurn, kStyle, kLevel, kNoise, kOrder, kRigged, kPurposes };
static_assert(kPurposes == 8, "another number makes every seed give other characters");

// Streams that begin with a number of another one.
enum DerivedStream : uint64_t { kHoles = 1 };

// Names the random streams of one character.
struct StreamKey {
  uint64_t seed;
  Split split;
  int64_t index;
  bool reference = false;
  int64_t take = 0;  // which pose of the identity

  Random Stream(Purpose purpose) const {
    // Injective in (seed, split) and in (index, reference, purpose); Random mixes both.
    const uint64_t base = 3 * seed + static_cast<uint64_t>(split);
    const uint64_t stream = (2 * static_cast<uint64_t>(index) + (reference ? 1 : 0)) * kPurposes + purpose;
    return take == 0 ? Random(base, stream)
                     : Random(Random(base, stream).Next(), static_cast<uint64_t>(take));
  }
};

// One identity at one resolution. The generator's body or rigged character, whose mesh it is, outlives it.
struct Identity {
  RestBody rest;
  const Faces* faces = nullptr;
  const RowMatrix* weights = nullptr;  // (V, 24)
  const Points* canonical = nullptr;   // (V, 3)
  std::optional<LimbScales> scales;
};

std::vector<AffineTransform> Transforms(const Identity& identity, const std::vector<Rotation>& global) {
  return identity.scales ? ScaledPoseTransforms(identity.rest.joints, global, *identity.scales)
                         : PoseTransforms(HumanSkeleton(), identity.rest.joints, global);
}

// Moves each vertex along its normal by a uniform amount of up to +-noise.
void AddNoise(Random& random, double noise, TriangleMesh& mesh) {
  const Points normals = VertexNormals(mesh.positions, mesh.faces);
  for (Eigen::Index v = 0; v < normals.rows(); ++v) {
    mesh.positions.row(v) += static_cast<float>(random.Uniform(-noise, noise)) * normals.row(v);
  }
}

// Puts row order[v] of each per-vertex matrix at row v.
void Reorder(const std::vector<int32_t>& order, Character& character) {
  const auto gather = [&order](auto& rows) {
    auto sorted = rows;
    for (size_t v = 0; v < order.size(); ++v) sorted.row(static_cast<Eigen::Index>(v)) = rows.row(order[v]);
    rows = std::move(sorted);
  };
  gather(character.mesh.positions);
  gather(character.weights);
  gather(character.canonical);
  std::vector<int32_t> place(order.size());
  for (size_t v = 0; v < order.size(); ++v) place[order[v]] = static_cast<int32_t>(v);
  for (Eigen::Index i = 0; i < character.mesh.faces.size(); ++i) {
    int32_t& vertex = character.mesh.faces.data()[i];
    vertex = place[vertex];
  }
}

std::vector<int32_t> RandomOrder(Random random, int64_t count) {
  std::vector<int32_t> order(count);
  std::iota(order.begin(), order.end(), 0);
  for (int64_t i = count - 1; i > 0; --i) std::swap(order[i], order[random.Below(i + 1)]);
  return order;
}

}  // namespace

struct CharacterGenerator::Model {
  explicit Model(CharacterPack pack)
      : body(std::make_shared<const BodyData>(std::move(pack.body))),
        motions(std::move(pack.clips)),
        rigged(std::move(pack.rigged)) {
    PlaceRigged();
  }

  // Fills what follows from `rigged`.
  void PlaceRigged() {
    const NeutralPlaces places(body);
    rigged_canonical.clear();
    for (std::vector<int>& indices : rigged_of) indices.clear();
    for (size_t i = 0; i < rigged.size(); ++i) {
      rigged_canonical.push_back(places.Of(rigged[i]));
      const Split split = rigged[i].held_out ? Split::kTest : Split::kTrain;
      rigged_of[static_cast<size_t>(split)].push_back(static_cast<int>(i));
    }
  }

  const std::vector<int>& RiggedOf(Split split) const { return rigged_of[static_cast<size_t>(split)]; }

  Identity OfBody(const ShapeParameters& shape, int level) const {
    return {body.Shape(shape, level), &body.faces(level), &body.weights(level), &body.canonical(level), {}};
  }

  Identity OfRigged(int index) const {
    const RiggedBody& character = rigged[index];
    return {character.rest, &character.faces, &character.weights, &rigged_canonical[index], {}};
  }

  Identity RandomOfBody(const StreamKey& key, int vertices) const {
    const int level = vertices < 0 ? static_cast<int>(key.Stream(kLevel).Below(body.level_count()))
                                   : body.NearestLevel(vertices);
    Random random = key.Stream(kIdentity);
    return OfBody(RandomShape(random, body.local_pairs()), level);
  }

  Identity MakeIdentity(const StreamKey& key, const CharacterOptions& options) const {
    const std::vector<int>& candidates = RiggedOf(options.split);
    Random random = key.Stream(kRigged);
    Identity identity = random.Chance(options.rigged_share)
                            ? OfRigged(candidates[random.Below(std::ssize(candidates))])
                            : RandomOfBody(key, options.vertices);
    Random style = key.Stream(kStyle);
    if (options.anisotropic_scale && style.Chance(kStyledShare)) identity.scales = SampleLimbScales(style);
    return identity;
  }

  // Global rotations of a random pose for that identity.
  std::vector<Rotation> MakePose(const StreamKey& key, const Identity& identity,
                                 const CharacterOptions& options) const {
    Random random = key.Stream(kPose);
    std::vector<Rotation> local =
        SamplePose(random, options.poses, motions, options.split, identity.rest.joints);
    Random turn = key.Stream(kTurn);
    if (options.global_rotation) local[kPelvis] = SampleGlobalTurn(turn) * local[kPelvis];
    return GlobalRotations(HumanSkeleton(), local);
  }

  // The identity in the pose, without noise and in its own vertex order.
  Character Pose(const Identity& identity, std::vector<Rotation> global) const {
    const std::vector<AffineTransform> transforms = Transforms(identity, global);
    Character character;
    character.weights = *identity.weights;
    character.mesh.positions = SkinPoints(identity.rest.positions, character.weights, transforms);
    character.mesh.faces = *identity.faces;
    character.joints = TransformJoints(identity.rest.joints, transforms);
    character.rest_joints =
        TransformJoints(identity.rest.joints,
                        Transforms(identity, std::vector<Rotation>(kHumanJoints, Rotation::Identity())));
    character.rotations = std::move(global);
    character.canonical = *identity.canonical;
    character.stature = identity.rest.stature;
    return character;
  }

  // Noise, holes and order, as the options ask.
  void Finish(const StreamKey& key, const CharacterOptions& options, Character& character) const {
    Random noise = key.Stream(kNoise);
    if (options.noise > 0) AddNoise(noise, options.noise, character.mesh);
    if (options.holes > 0) {
      Random holes(key.Stream(kNoise).Next(), kHoles);
      TriangleMesh& mesh = character.mesh;
      mesh.faces = CutHoles(holes, options.holes, mesh.positions, mesh.faces);
    }
    if (options.shuffle_vertices) {
      Reorder(RandomOrder(key.Stream(kOrder), character.mesh.vertex_count()), character);
    }
  }

  BodyModel body;
  MotionLibrary motions;
  std::vector<RiggedBody> rigged;
  std::vector<Points> rigged_canonical;       // per rigged body (V, 3)
  std::array<std::vector<int>, 3> rigged_of;  // by Split: indices into `rigged`
};

CharacterGenerator::CharacterGenerator(std::unique_ptr<Model> model) : model_(std::move(model)) {}
CharacterGenerator::~CharacterGenerator() = default;

absl::StatusOr<std::unique_ptr<CharacterGenerator>> CharacterGenerator::FromData(
    const std::filesystem::path& mpfb_dir, const std::filesystem::path& bvh_dir) {
  CharacterPack pack;
  STANCE_ASSIGN_OR_RETURN(pack.body, ReadMpfbBody(mpfb_dir));
  // Only the whole body and no morph matter for the joints, but the model is cheap next to the reading.
  const Points joints = BodyModel(std::make_shared<const BodyData>(pack.body)).Shape({}, 0).joints;
  STANCE_ASSIGN_OR_RETURN(pack.clips, ReadMotions(bvh_dir, joints));
  return std::unique_ptr<CharacterGenerator>(
      new CharacterGenerator(std::make_unique<Model>(std::move(pack))));
}

absl::StatusOr<std::unique_ptr<CharacterGenerator>> CharacterGenerator::FromPack(
    const std::filesystem::path& path) {
  STANCE_ASSIGN_OR_RETURN(const std::string bytes, ReadFile(path));
  absl::StatusOr<CharacterPack> pack = ParsePack(bytes);
  if (!pack.ok()) {
    return absl::DataLossError(fmt::format("{}: {}", path.string(), std::string(pack.status().message())));
  }
  return std::unique_ptr<CharacterGenerator>(
      new CharacterGenerator(std::make_unique<Model>(*std::move(pack))));
}

absl::Status CharacterGenerator::WritePack(const std::filesystem::path& path) const {
  return WriteFile(path, SerializePack({model_->body.data(), model_->motions.clips(), model_->rigged}));
}

absl::StatusOr<std::vector<std::string>> CharacterGenerator::AddRigged(const std::filesystem::path& folder) {
  STANCE_ASSIGN_OR_RETURN(RiggedFolder found, ReadRiggedFolder(folder, model_->body.Shape({}, 0)));
  std::move(found.bodies.begin(), found.bodies.end(), std::back_inserter(model_->rigged));
  model_->PlaceRigged();
  return std::move(found.refused);
}

absl::Status CharacterGenerator::Check(const CharacterOptions& options) const {
  if (!(options.rigged_share >= 0 && options.rigged_share <= 1)) {
    return absl::InvalidArgumentError(fmt::format("rigged_share: {} is not in 0..1", options.rigged_share));
  }
  if (options.rigged_share > 0 && model_->RiggedOf(options.split).empty()) {
    return absl::InvalidArgumentError(
        fmt::format("rigged_share: {}, but the data hold no rigged characters of this split: write a pack "
                    "with --rigged",
                    options.rigged_share));
  }
  return absl::OkStatus();
}

std::vector<std::string> CharacterGenerator::RiggedNames(Split split) const {
  std::vector<std::string> names;
  for (const int i : model_->RiggedOf(split)) names.push_back(model_->rigged[i].name);
  return names;
}

Character CharacterGenerator::Make(uint64_t seed, int64_t index, const CharacterOptions& options) const {
  const StreamKey key{seed, options.split, index};
  const Identity identity = model_->MakeIdentity(key, options);
  Character character = model_->Pose(identity, model_->MakePose(key, identity, options));
  model_->Finish(key, options, character);
  return character;
}

TransferPair CharacterGenerator::MakePair(uint64_t seed, int64_t index,
                                          const CharacterOptions& options) const {
  const StreamKey key{seed, options.split, index};
  StreamKey reference_key = key;
  reference_key.reference = true;
  const Identity source = model_->MakeIdentity(key, options);
  const Identity reference = model_->MakeIdentity(reference_key, options);
  const std::vector<Rotation> pose = model_->MakePose(reference_key, reference, options);

  TransferPair pair;
  pair.source = model_->Pose(source, model_->MakePose(key, source, options));
  pair.reference = model_->Pose(reference, pose);
  // Posing turns the body about its pelvis, which stays where it rests: source and truth share its place.
  Character truth = model_->Pose(source, pose);
  CharacterOptions noiseless = options;
  noiseless.noise = 0;
  model_->Finish(key, noiseless, pair.source);
  model_->Finish(key, noiseless, truth);  // the same order as the source's
  model_->Finish(reference_key, options, pair.reference);
  pair.truth = std::move(truth.mesh.positions);
  return pair;
}

std::vector<Character> CharacterGenerator::MakePoses(uint64_t seed, int64_t index, int count,
                                                     const CharacterOptions& options) const {
  StreamKey key{seed, options.split, index};
  const Identity identity = model_->MakeIdentity(key, options);
  std::vector<Character> characters;
  for (key.take = 0; key.take < count; ++key.take) {
    characters.push_back(model_->Pose(identity, model_->MakePose(key, identity, options)));
    model_->Finish(key, options, characters.back());
  }
  return characters;
}

Character CharacterGenerator::Neutral(int vertices) const {
  STANCE_CHECK(vertices >= 0);
  return model_->Pose(model_->OfBody({}, model_->body.NearestLevel(vertices)),
                      std::vector<Rotation>(kHumanJoints, Rotation::Identity()));
}

}  // namespace stance

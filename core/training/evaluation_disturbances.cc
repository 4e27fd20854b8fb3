#include "core/training/evaluation_disturbances.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "core/mesh/measure.h"
#include "core/training/decimation.h"
#include "core/training/evaluation_pairs.h"
#include "core/training/holes.h"
#include "core/training/skinning.h"
#include "core/training/subdivision.h"

namespace stance {
namespace {

// Puts change(rows) in the place of every per-vertex matrix; `truth` may be null.
template <class Change>
void ChangeRows(Character& character, Points* truth, Change change) {
  character.mesh.positions = change(character.mesh.positions);
  character.weights = change(character.weights);
  character.canonical = change(character.canonical);
  if (truth != nullptr) *truth = change(*truth);
}

void SetFaces(Character& character, Faces faces) {
  TriangleMesh bare;
  bare.positions = std::move(character.mesh.positions);
  bare.faces = std::move(faces);
  character.mesh = std::move(bare);
}

// Keeps the vertices `kept`; `faces` name rows of `kept`.
void KeepVertices(const std::vector<int32_t>& kept, Faces faces, Character& character, Points* truth) {
  ChangeRows(character, truth, [&kept]<class Rows>(const Rows& rows) {
    Rows some(static_cast<Eigen::Index>(kept.size()), rows.cols());
    for (size_t v = 0; v < kept.size(); ++v) some.row(static_cast<Eigen::Index>(v)) = rows.row(kept[v]);
    return some;
  });
  SetFaces(character, std::move(faces));
}

void Remesh(int64_t count, double keep_within, Character& character, Points* truth) {
  const TriangleMesh& mesh = character.mesh;
  const double ratio = static_cast<double>(mesh.vertex_count()) / static_cast<double>(count);
  if (std::max(ratio, 1 / ratio) <= keep_within) return;
  if (count < mesh.vertex_count()) {
    BodyTopology level = std::move(BuildLevels(mesh.positions, mesh.faces, {static_cast<int>(count)}).back());
    KeepVertices(level.vertices, std::move(level.faces), character, truth);
  } else {
    Subdivision fine = SubdivideLongestEdges(mesh.positions, mesh.faces, count);
    ChangeRows(character, truth, [&fine](const auto& rows) { return WithMidpoints(rows, fine.parents); });
    SetFaces(character, std::move(fine.faces));
  }
}

// (V, 3) metres.
Points NormalOffsets(const Character& character, double deviation, Random random) {
  Points offsets = VertexNormals(character.mesh.positions, character.mesh.faces);
  for (Eigen::Index v = 0; v < offsets.rows(); ++v) {
    offsets.row(v) *= static_cast<float>(random.Normal() * deviation * character.stature);
  }
  return offsets;
}

void CutHolesInto(double share, Random random, Character& character, Points* truth) {
  Faces faces = CutShare(random, share, character.mesh.positions, character.mesh.faces);
  if (faces.rows() == character.mesh.face_count()) return;
  std::vector<int32_t> place(static_cast<size_t>(character.mesh.vertex_count()), -1), kept;
  const std::span<int32_t> corners(faces.data(), static_cast<size_t>(faces.size()));
  for (const int32_t v : corners) place[v] = 0;
  for (size_t v = 0; v < place.size(); ++v) {
    if (place[v] < 0) continue;
    place[v] = static_cast<int32_t>(kept.size());
    kept.push_back(static_cast<int32_t>(v));
  }
  for (int32_t& v : corners) v = place[v];
  KeepVertices(kept, std::move(faces), character, truth);
}

void TurnAbout(const Eigen::RowVector3f& centre, const Rotation& turn, Points& points) {
  const Points turned = (points.rowwise() - centre) * turn.transpose();
  points = turned.rowwise() + centre;
}

// The pelvis stays; so do the places at rest.
void Turn(const Rotation& turn, Character& character) {
  const Eigen::RowVector3f pelvis = character.joints.row(kPelvis);
  TurnAbout(pelvis, turn, character.mesh.positions);
  TurnAbout(pelvis, turn, character.joints);
  for (Rotation& rotation : character.rotations) rotation = turn * rotation;
}

}  // namespace

TransferPair Remeshed(TransferPair pair, int64_t count, double keep_within) {
  Remesh(count, keep_within, pair.source, &pair.truth);
  Remesh(count, keep_within, pair.reference, nullptr);
  return pair;
}

TransferPair WithNoise(TransferPair pair, double deviation, Random& random) {
  const Random of_source(random.Next()), of_reference(random.Next());
  if (deviation == 0) return pair;
  std::vector<AffineTransform> turns;
  for (const Rotation& rotation : TrueRotations(pair)) turns.push_back({.linear = rotation});
  const Points offsets = NormalOffsets(pair.source, deviation, of_source);
  pair.truth += SkinPoints(offsets, pair.source.weights, turns);
  pair.source.mesh.positions += offsets;
  pair.reference.mesh.positions += NormalOffsets(pair.reference, deviation, of_reference);
  return pair;
}

TransferPair WithHoles(TransferPair pair, double share, Random& random) {
  const Random of_source(random.Next()), of_reference(random.Next());
  CutHolesInto(share, of_source, pair.source, &pair.truth);
  CutHolesInto(share, of_reference, pair.reference, nullptr);
  return pair;
}

TransferPair Tilted(TransferPair pair, double angle, Random& random) {
  const double azimuth = random.Uniform(0, 2 * std::numbers::pi);
  if (angle == 0) return pair;
  const Eigen::Vector3d axis(std::cos(azimuth), 0, std::sin(azimuth));
  const Rotation turn = Eigen::AngleAxisd(angle, axis).toRotationMatrix().cast<float>();
  TurnAbout(pair.source.joints.row(kPelvis), turn, pair.truth);
  Turn(turn, pair.source);
  Turn(turn, pair.reference);
  return pair;
}

}  // namespace stance

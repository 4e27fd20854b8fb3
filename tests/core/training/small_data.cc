#include "tests/core/training/small_data.h"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>
#include <string_view>
#include <utility>
#include <vector>

#include "core/base/random.h"
#include "core/skeleton/skeleton.h"

namespace stance::testing {
namespace {

using std::filesystem::path;

constexpr int kTubes = 15, kRings = 10, kSides = 12;

constexpr std::array<const char*, kHumanJoints> kBones = {
    "Hips",        "LeftUpLeg",    "RightUpLeg",    "Spine",     "LeftLeg",         "RightLeg",
    "Spine1",      "LeftFoot",     "RightFoot",     "Spine2",    "LeftToeBase",     "RightToeBase",
    "Neck",        "LeftShoulder", "RightShoulder", "Head",      "LeftArm",         "RightArm",
    "LeftForeArm", "RightForeArm", "LeftHand",      "RightHand", "LeftHandMiddle1", "RightHandMiddle1"};

// Left and midline joints, metres; the arms hang by 40 degrees, the elbows are bent.
Points MakeJoints() {
  Points joints(kHumanJoints, 3);
  const std::vector<std::pair<int, Eigen::RowVector3f>> left = {{kPelvis, {0, 0.95f, 0}},
                                                                {kSpine1, {0, 1.05f, 0}},
                                                                {kSpine2, {0, 1.17f, 0}},
                                                                {kSpine3, {0, 1.28f, 0}},
                                                                {kNeck, {0, 1.45f, 0}},
                                                                {kHead, {0, 1.52f, 0}},
                                                                {kLeftHip, {0.1f, 0.9f, 0}},
                                                                {kLeftKnee, {0.11f, 0.5f, 0.01f}},
                                                                {kLeftAnkle, {0.12f, 0.08f, 0}},
                                                                {kLeftFoot, {0.12f, 0.03f, 0.13f}},
                                                                {kLeftCollar, {0.05f, 1.42f, 0}},
                                                                {kLeftShoulder, {0.17f, 1.4f, 0}},
                                                                {kLeftElbow, {0.37f, 1.23f, 0}},
                                                                {kLeftWrist, {0.55f, 1.08f, 0.06f}},
                                                                {kLeftHand, {0.62f, 1.02f, 0.08f}}};
  for (const auto& [joint, place] : left) {
    joints.row(joint) = place;
    joints.row(MirrorJoint(joint)) =
        Eigen::RowVector3f(joint == MirrorJoint(joint) ? 0 : -place.x(), place.y(), place.z());
  }
  return joints;
}

struct Tube {
  Eigen::Vector3f from, to;
  float radius;
  int first_joint, last_joint;  // weights run linearly from one to the other
};

std::vector<Tube> MakeTubes() {
  const Points joints = MakeJoints();
  std::vector<Tube> tubes;
  const auto add = [&](int from, int to, float radius) {
    tubes.push_back({joints.row(from).transpose(), joints.row(to).transpose(), radius, from, to});
  };
  add(kPelvis, kSpine2, 0.14f);
  add(kSpine2, kNeck, 0.13f);
  tubes.push_back({joints.row(kNeck).transpose(), {0, 1.7f, 0}, 0.09f, kNeck, kHead});
  for (const int side : {0, 1}) {
    add(kLeftHip + side, kLeftKnee + side, 0.07f);
    add(kLeftKnee + side, kLeftAnkle + side, 0.05f);
    add(kLeftAnkle + side, kLeftFoot + side, 0.03f);
    add(kLeftCollar + side, kLeftShoulder + side, 0.06f);
    add(kLeftShoulder + side, kLeftElbow + side, 0.05f);
    add(kLeftElbow + side, kLeftHand + side, 0.04f);
  }
  return tubes;
}

void WriteText(const path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary) << text;
}

std::string Vertex(const Eigen::Vector3f& p) {
  return fmt::format("v {:.4f} {:.4f} {:.4f}\n", 10 * p.x(), 10 * p.y(), 10 * p.z());
}

// The coordinates of base.obj's vertices, metres: the tubes' rings, then a cube of 8 around each joint.
std::vector<Eigen::Vector3f> BaseVertices() {
  std::vector<Eigen::Vector3f> vertices;
  for (const Tube& tube : MakeTubes()) {
    const Eigen::Vector3f axis = (tube.to - tube.from).normalized();
    // A frame that mirrors with the axis, so that the body is symmetric.
    const Eigen::Vector3f across = axis.cross(Eigen::Vector3f(0, 0.6f, 0.8f)).normalized();
    const Eigen::Vector3f third = axis.cross(across);
    for (int r = 0; r < kRings; ++r) {
      for (int s = 0; s < kSides; ++s) {
        const auto angle = static_cast<float>(2 * EIGEN_PI * s / kSides);
        const Eigen::Vector3f centre =
            tube.from + (tube.to - tube.from) * (static_cast<float>(r) / (kRings - 1));
        vertices.push_back(centre + tube.radius * (std::cos(angle) * across + std::sin(angle) * third));
      }
    }
  }
  const Points joints = MakeJoints();
  for (int j = 0; j < kHumanJoints; ++j) {
    for (int corner = 0; corner < 8; ++corner) {
      vertices.push_back(joints.row(j).transpose() + 0.01f * Eigen::Vector3f(corner & 1 ? 1.f : -1.f,
                                                                             corner & 2 ? 1.f : -1.f,
                                                                             corner & 4 ? 1.f : -1.f));
    }
  }
  return vertices;
}

std::string BaseObj() {
  std::string text = "# a body of tubes\n";
  for (const Eigen::Vector3f& vertex : BaseVertices()) text += Vertex(vertex);
  text += "g body\n";
  for (int t = 0; t < kTubes; ++t) {
    for (int r = 0; r + 1 < kRings; ++r) {
      for (int s = 0; s < kSides; ++s) {
        const int a = (t * kRings + r) * kSides + s + 1, b = (t * kRings + r) * kSides + (s + 1) % kSides + 1;
        text += fmt::format("f {0}/{0} {1}/{1} {2}/{2} {3}/{3}\n", a, b, b + kSides, a + kSides);
      }
    }
  }
  for (int j = 0; j < kHumanJoints; ++j) {
    const int first = kSmallBodyVertices + 8 * j + 1;
    text += fmt::format("g joint-{}\nf {} {} {} {}\nf {} {} {} {}\n", kBones[j], first, first + 1, first + 3,
                        first + 2, first + 4, first + 5, first + 7, first + 6);
  }
  return text;
}

// Cubes, but for the head: the mean of two corners.
std::string RigJson() {
  std::string text = "{\"bones\": {";
  for (int j = 0; j < kHumanJoints; ++j) {
    const int first = kSmallBodyVertices + 8 * j;
    std::string head = fmt::format(R"("strategy": "CUBE", "cube_name": "joint-{}")", kBones[j]);
    if (j == kHead) {
      head = fmt::format(R"("strategy": "MEAN", "vertex_indices": [{}, {}])", first, first + 7);
    }
    text += fmt::format("{}\"mixamorig:{}\": {{\"head\": {{\"default_position\": [9, 9, 9], {}}}}}",
                        j > 0 ? ", " : "", kBones[j], head);
  }
  return text + "}}";
}

std::string WeightsJson() {
  std::vector<std::string> influences(kHumanJoints);
  std::string thumb, finger;
  const std::vector<Tube> tubes = MakeTubes();
  for (int v = 0; v < kSmallBodyVertices; ++v) {
    const Tube& tube = tubes[v / (kRings * kSides)];
    // The first three rings and the last three follow one joint only.
    const double along = std::clamp((v / kSides % kRings - 2) / (kRings - 5.0), 0.0, 1.0);
    const double sum = 0.4 + 0.8 * (v % 7) / 6;
    const auto put = [v](std::string& list, double weight) {
      list += fmt::format("{}[{}, {:.5f}]", list.empty() ? "" : ", ", v, weight);
    };
    put(influences[tube.first_joint], sum * (1 - along));
    // The left hand's share is spread over a finger and the thumb.
    if (tube.last_joint == kLeftHand && v % 3 == 0) {
      put(finger, sum * along);
    } else if (tube.last_joint == kLeftHand && v % 3 == 1) {
      put(thumb, sum * along);
    } else {
      put(influences[tube.last_joint], sum * along);
    }
  }
  std::string text = "{\"version\": 110, \"weights\": {";
  for (int j = 0; j < kHumanJoints; ++j)
    text += fmt::format("\"mixamorig:{}\": [{}], ", kBones[j], influences[j]);
  text +=
      fmt::format("\"mixamorig:LeftHandThumb2\": [{}], \"mixamorig:LeftHandIndex3\": [{}]", thumb, finger);
  return text + "}}";
}

// A target that scales the base mesh about the ground, in every `stride`-th body vertex and all helpers.
std::string ScalingTarget(const Eigen::Vector3f& growth, int stride) {
  std::string text = "# a comment\n";
  const std::vector<Eigen::Vector3f> vertices = BaseVertices();
  for (size_t v = 0; v < vertices.size(); ++v) {
    if (v < kSmallBodyVertices && v % stride != 0) continue;
    const Eigen::Vector3f delta = 10 * growth.cwiseProduct(vertices[v]);
    text += fmt::format("{} {:.3f} {:.3f} {:.3f}\n", v, delta.x(), delta.y(), delta.z());
  }
  return text;
}

void WriteTargets(const path& targets) {
  const path macro = targets / "macrodetails";
  const std::string wide = ScalingTarget({0.05f, 0, 0.05f}, 1), tall = ScalingTarget({0, 0.08f, 0}, 1);
  const std::string small = ScalingTarget({0, -0.08f, 0}, 1), slight = ScalingTarget({0.01f, 0.005f, 0}, 1);
  for (const std::string gender : {"male", "female"}) {
    for (const std::string age : {"child", "young", "old"}) {
      for (const std::string race : {"african", "asian", "caucasian"}) {
        WriteGzip(macro / fmt::format("{}-{}-{}.target.gz", race, gender, age), slight);
      }
      for (const std::string muscle : {"minmuscle", "averagemuscle", "maxmuscle"}) {
        for (const std::string weight : {"minweight", "averageweight", "maxweight"}) {
          const std::string build = fmt::format("{}-{}-{}-{}", gender, age, muscle, weight);
          WriteGzip(macro / ("universal-" + build + ".target.gz"), weight == "maxweight" ? wide : slight);
          WriteGzip(macro / "height" / (build + "-minheight.target.gz"), small);
          WriteGzip(macro / "height" / (build + "-maxheight.target.gz"), tall);
          WriteGzip(macro / "proportions" / (build + "-idealproportions.target.gz"), slight);
          WriteGzip(macro / "proportions" / (build + "-uncommonproportions.target.gz"), slight);
        }
      }
    }
  }
  // One of the optional combinations.
  WriteGzip(targets / "breast" / "female-young-averagemuscle-averageweight-maxcup-maxfirmness.target.gz",
            slight);
  WriteText(targets / "target.json",
            R"({"arms": {"categories": [{"name": "upperarm", "opposites": {
                 "negative-left": "l-thin", "positive-left": "l-thick", "negative-right": "",
                 "positive-right": "", "negative-unsided": "", "positive-unsided": ""}},
                 {"name": "without opposites"}]},
                "torso": {"categories": [{"name": "torso", "opposites": {
                 "negative-unsided": "narrow", "positive-unsided": "broad"}}]},
                "mouth": {"categories": [{"name": "of the face", "opposites": {
                 "negative-unsided": "not-there", "positive-unsided": "nor-there"}}]}})");
  WriteGzip(targets / "arms" / "l-thin.target.gz", ScalingTarget({0, 0, -0.2f}, 5));
  WriteGzip(targets / "arms" / "l-thick.target.gz", ScalingTarget({0, 0, 0.2f}, 5));
  WriteGzip(targets / "torso" / "narrow.target.gz", ScalingTarget({-0.1f, 0, 0}, 3));
  WriteGzip(targets / "torso" / "broad.target.gz", ScalingTarget({0.1f, 0, 0}, 3));
}

// The part of the CMU skeleton that the retargeting needs, in centimetres: name, depth, offset. Closing
// braces follow from the depths.
struct BvhLine {
  std::string_view name;
  int depth;
  std::array<double, 3> offset;
};
constexpr std::array<BvhLine, 19> kBvh = {{{"hip", 0, {0, 0, 0}},
                                           {"abdomen", 1, {0, 20, -1}},
                                           {"chest", 2, {0, 12, -1}},
                                           {"neck", 3, {0, 22, -2}},
                                           {"head", 4, {0, 7, 1}},
                                           {"rCollar", 3, {-3, 19, -5}},
                                           {"rShldr", 4, {-9, -2, 1}},
                                           {"rForeArm", 5, {-28, -2, 0}},
                                           {"rHand", 6, {-23, 1, 7}},
                                           {"rMid1", 7, {-8, 1, 3}},
                                           {"lCollar", 3, {3, 19, -5}},
                                           {"lShldr", 4, {9, -2, 1}},
                                           {"lForeArm", 5, {28, -2, 0}},
                                           {"lHand", 6, {23, 1, 7}},
                                           {"lMid1", 7, {8, 1, 3}},
                                           {"rThigh", 1, {-9, 3, -1}},
                                           {"rShin", 2, {0, -37, 1}},
                                           {"rFoot", 3, {1, -45, -5}},
                                           {"lThigh", 1, {9, 3, -1}}}};
constexpr std::array<BvhLine, 2> kBvhLeftLeg = {{{"lShin", 2, {0, -37, 1}}, {"lFoot", 3, {-1, -45, -5}}}};

}  // namespace

TemporaryFolder::TemporaryFolder() {
  const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
  std::string name = test ? test->name() : "stance";
  std::replace(name.begin(), name.end(), '/', '_');  // of a parameterised test
  std::string pattern = fmt::format("{}/{}_XXXXXX", ::testing::TempDir(), name);
  const char* const made = mkdtemp(pattern.data());
  EXPECT_NE(made, nullptr) << pattern;
  if (made != nullptr) path_ = made;
}

TemporaryFolder::~TemporaryFolder() {
  if (!path_.empty()) std::filesystem::remove_all(path_);
}

void WriteGzip(const path& file, const std::string& text) {
  std::filesystem::create_directories(file.parent_path());
  const gzFile out = gzopen(file.c_str(), "wb1");
  ASSERT_NE(out, nullptr);
  ASSERT_EQ(gzwrite(out, text.data(), static_cast<unsigned>(text.size())), static_cast<int>(text.size()));
  ASSERT_EQ(gzclose(out), Z_OK);
}

Points SmallBodyJoints() { return MakeJoints(); }

Points TPoseJoints() {
  Points joints = MakeJoints();
  for (const int side : {0, 1}) {
    const float sign = side == 0 ? 1.0f : -1.0f;
    const Eigen::RowVector3f shoulder = joints.row(kLeftShoulder + side);
    joints.row(kLeftElbow + side) = shoulder + Eigen::RowVector3f(sign * 0.27f, 0, 0);
    joints.row(kLeftWrist + side) = shoulder + Eigen::RowVector3f(sign * 0.5f, 0, 0);
    joints.row(kLeftHand + side) = shoulder + Eigen::RowVector3f(sign * 0.6f, 0, 0);
  }
  return joints;
}

void WriteSmallBody(const path& folder) {
  WriteText(folder / "3dobjs" / "base.obj", BaseObj());
  WriteText(folder / "rigs" / "standard" / "rig.mixamo.json", RigJson());
  WriteText(folder / "rigs" / "standard" / "weights.mixamo.json", WeightsJson());
  WriteTargets(folder / "targets");
}

std::string SmallMotion(uint64_t seed) {
  std::vector<BvhLine> lines(kBvh.begin(), kBvh.end());
  lines.insert(lines.end(), kBvhLeftLeg.begin(), kBvhLeftLeg.end());
  std::string text = "HIERARCHY\n";
  int open = 0;
  for (const BvhLine& line : lines) {
    for (; open > line.depth; --open) text += "}\n";
    text += fmt::format("{} {}\n{{\nOFFSET {} {} {}\n", open == 0 ? "ROOT" : "JOINT", line.name,
                        line.offset[0], line.offset[1], line.offset[2]);
    text += open == 0 ? "CHANNELS 6 Xposition Yposition Zposition Zrotation Yrotation Xrotation\n"
                      : "CHANNELS 3 Zrotation Xrotation Yrotation\n";
    open = line.depth + 1;
  }
  for (; open > 0; --open) text += "}\n";
  text += "MOTION\nFrames: 6\nFrame Time: 0.1\n";
  Random random(seed);
  for (int frame = 0; frame < 6; ++frame) {
    for (size_t c = 0; c < 3 + 3 * lines.size(); ++c) {
      text += fmt::format("{:.3f} ", frame == 0 ? 0.0 : random.Uniform(-40, 40));
    }
    text += '\n';
  }
  return text;
}

void WriteSmallMotions(const path& folder, int clips) {
  for (int i = 0; i < clips; ++i) WriteText(folder / fmt::format("clip_{:02}.bvh", i), SmallMotion(i + 1));
}

}  // namespace stance::testing

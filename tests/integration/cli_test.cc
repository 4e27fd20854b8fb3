// `stance` as a script sees it: the real program against the real server, with an untrained model.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <nlohmann/json.hpp>
#include <sstream>
#include <string>
#include <vector>

#include "core/mesh/mesh_io.h"
#include "tests/support/meshes.h"
#include "tests/support/process.h"
#include "tests/support/puppet.h"
#include "tests/support/server_process.h"

namespace stance {
namespace {

namespace fs = std::filesystem;
using ::testing::AllOf;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using testing::ProgramResult;
using ::testing::SizeIs;
using ::testing::StartsWith;

std::string Content(const fs::path& path) {
  std::ifstream stream(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

TriangleMesh Read(const fs::path& path) {
  absl::StatusOr<TriangleMesh> mesh = ReadMesh(path);
  EXPECT_TRUE(mesh.ok()) << mesh.status();
  return mesh.ok() ? *std::move(mesh) : TriangleMesh();
}

// One line that begins with the program's name, as a script that shows it to a person expects.
void ExpectOneErrorLine(const ProgramResult& result) {
  EXPECT_THAT(result.err, AllOf(StartsWith("stance: "), EndsWith("\n")));
  EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
}

class CliTest : public ::testing::Test {
 protected:
  // Serves both methods, so that its default is `stance`.
  static void SetUpTestSuite() {
    server_ = new testing::ServerProcess({"--model", STANCE_UNTRAINED_STANCE_MODEL});
  }
  static void TearDownTestSuite() {
    EXPECT_EQ(server_->Stop(), 0) << server_->Log();
    delete server_;
  }

  void SetUp() override {
    folder_ = fs::path(::testing::TempDir()) /
              ("stance-cli-" + std::string(::testing::UnitTest::GetInstance()->current_test_info()->name()));
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    const testing::Puppet puppet = testing::MakePuppet();
    source_ = testing::WithAttributes(puppet.mesh);
    Write(source_, "source.obj");
    Write(testing::Pose(puppet, testing::RandomPose(3, 0.4)).mesh, "reference.ply");
  }
  void TearDown() override { fs::remove_all(folder_); }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  void Write(const TriangleMesh& mesh, const std::string& name) const {
    ASSERT_TRUE(WriteMesh(mesh, folder_ / name).ok());
  }
  std::vector<std::string> Files() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_)) names.push_back(entry.path().filename());
    return names;
  }

  static ProgramResult Run(std::vector<std::string> words) {
    words.insert(words.begin(), STANCE_BINARY);
    return testing::RunProgram(words);
  }
  // `transfer SOURCE REFERENCE` and further words, on the server.
  ProgramResult Transfer(const std::string& source, const std::string& reference,
                         const std::vector<std::string>& more) const {
    std::vector<std::string> words = {"transfer", Path(source), Path(reference), "--server",
                                      server_->address()};
    words.insert(words.end(), more.begin(), more.end());
    return Run(words);
  }
  ProgramResult Transfer(const std::vector<std::string>& more) const {
    return Transfer("source.obj", "reference.ply", more);
  }

  static testing::ServerProcess* server_;
  fs::path folder_;
  TriangleMesh source_;
};

testing::ServerProcess* CliTest::server_ = nullptr;

TEST_F(CliTest, TargetKeepsTheSourcesOrderFacesAndAttributes) {
  const ProgramResult result = Transfer({"-o", Path("target.obj")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, IsEmpty());
  EXPECT_THAT(result.out, HasSubstr("wrote " + Path("target.obj")));
  const TriangleMesh source = Read(Path("source.obj"));
  const TriangleMesh target = Read(Path("target.obj"));
  ASSERT_EQ(target.vertex_count(), source.vertex_count());
  EXPECT_EQ(target.faces, source.faces);
  EXPECT_EQ(target.texcoords, source.texcoords);
  EXPECT_EQ(target.normals.rows(), source.normals.rows());
  ASSERT_EQ(target.groups.size(), source.groups.size());
  for (size_t i = 0; i < source.groups.size(); ++i) {
    EXPECT_EQ(target.groups[i].name, source.groups[i].name);
    EXPECT_EQ(target.groups[i].first_face, source.groups[i].first_face);
  }
  EXPECT_TRUE(target.positions.allFinite());
  EXPECT_FALSE(target.positions.isApprox(source.positions, 1e-3f)) << "the pose did not change";
}

TEST_F(CliTest, EveryFormatHoldsTheSameTarget) {
  const ProgramResult result = Transfer({"-o", Path("t.obj"), "-o", Path("t.ply"), "-o", Path("t.off"), "-o",
                                         Path("t.glb"), "-o", Path("t.stl")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const TriangleMesh first = Read(Path("t.obj"));
  for (const char* name : {"t.ply", "t.off", "t.glb"}) {
    const TriangleMesh mesh = Read(Path(name));
    ASSERT_EQ(mesh.vertex_count(), source_.vertex_count()) << name;
    EXPECT_LT((mesh.positions - first.positions).cwiseAbs().maxCoeff(), 1e-6f) << name;
    EXPECT_EQ(mesh.faces, source_.faces) << name;
  }
  EXPECT_EQ(Read(Path("t.stl")).face_count(), source_.face_count());
}

TEST_F(CliTest, LocalEqualsServer) {
  const std::vector<std::string> local = {"transfer",
                                          Path("source.obj"),
                                          Path("reference.ply"),
                                          "--local",
                                          "--model",
                                          STANCE_UNTRAINED_MODEL,
                                          "--model",
                                          STANCE_UNTRAINED_STANCE_MODEL,
                                          "-o",
                                          Path("l.ply"),
                                          "--skeleton",
                                          Path("l_s.json"),
                                          "--weights",
                                          Path("l_w.json")};
  ASSERT_EQ(Run(local).exit_code, 0);
  const ProgramResult remote =
      Transfer({"-o", Path("r.ply"), "--skeleton", Path("r_s.json"), "--weights", Path("r_w.json")});
  ASSERT_EQ(remote.exit_code, 0) << remote.err;
  const TriangleMesh a = Read(Path("l.ply"));
  const TriangleMesh b = Read(Path("r.ply"));
  ASSERT_EQ(a.vertex_count(), b.vertex_count());
  EXPECT_LE((a.positions - b.positions).cwiseAbs().maxCoeff(), 1e-5f);
  const auto skeleton_a = nlohmann::json::parse(Content(Path("l_s.json")));
  const auto skeleton_b = nlohmann::json::parse(Content(Path("r_s.json")));
  EXPECT_EQ(skeleton_a["names"], skeleton_b["names"]);
  EXPECT_EQ(skeleton_a["parents"], skeleton_b["parents"]);
  for (const char* which : {"source", "reference", "target"}) {
    for (size_t j = 0; j < 24; ++j) {
      for (size_t c = 0; c < 3; ++c) {
        EXPECT_NEAR(skeleton_a["joints"][which][j][c].get<float>(),
                    skeleton_b["joints"][which][j][c].get<float>(), 1e-5f);
      }
    }
  }
  EXPECT_EQ(nlohmann::json::parse(Content(Path("l_w.json")))["row_offsets"],
            nlohmann::json::parse(Content(Path("r_w.json")))["row_offsets"]);
}

TEST_F(CliTest, ATurnedSourceGivesTheTurnedTarget) {
  // z up: (x, y, z) -> (x, -z, y), which --source-up z undoes. A quarter turn is exact in floating point.
  TriangleMesh turned = source_;
  turned.positions.col(1) = -source_.positions.col(2);
  turned.positions.col(2) = source_.positions.col(1);
  Write(turned, "turned.ply");
  Write(source_, "upright.ply");
  ASSERT_EQ(Transfer("upright.ply", "reference.ply", {"-o", Path("a.ply")}).exit_code, 0);
  ASSERT_EQ(Transfer("turned.ply", "reference.ply", {"-o", Path("b.ply"), "--source-up", "z"}).exit_code, 0);
  const Points a = Read(Path("a.ply")).positions;
  const Points b = Read(Path("b.ply")).positions;
  ASSERT_EQ(a.rows(), b.rows());
  EXPECT_LE((a.col(0) - b.col(0)).cwiseAbs().maxCoeff(), 1e-4f);
  EXPECT_LE((a.col(2) + b.col(1)).cwiseAbs().maxCoeff(), 1e-4f);
  EXPECT_LE((a.col(1) - b.col(2)).cwiseAbs().maxCoeff(), 1e-4f);
}

TEST_F(CliTest, WeightsSumToOneAndNamesFollowTheNaming) {
  const ProgramResult result = Transfer({"-o", Path("t.obj"), "--weights", Path("w.csv"), "--bone-names",
                                         "mixamo", "--max-influences", "2", "--skeleton", Path("s.json")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  std::istringstream lines(Content(Path("w.csv")));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "vertex,joint,name,weight");
  std::map<int, double> sums;
  std::map<int, int> counts;
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    std::string vertex, joint, name, weight;
    std::getline(cells, vertex, ','), std::getline(cells, joint, ','), std::getline(cells, name, ',');
    std::getline(cells, weight);
    EXPECT_THAT(name, StartsWith("mixamorig:"));
    sums[std::stoi(vertex)] += std::stod(weight);
    EXPECT_LE(++counts[std::stoi(vertex)], 2);
  }
  ASSERT_EQ(static_cast<int64_t>(sums.size()), source_.vertex_count());
  for (const auto& [vertex, sum] : sums) EXPECT_NEAR(sum, 1.0, 1e-5) << vertex;
  const auto skeleton = nlohmann::json::parse(Content(Path("s.json")));
  EXPECT_EQ(skeleton["names"][0], "mixamorig:Hips");
  EXPECT_THAT(skeleton["transforms"], SizeIs(24));
}

TEST_F(CliTest, ViewsAreWritten) {
  const ProgramResult result = Transfer({"-o", Path("t.obj"), "--view", Path("v.png")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(Content(Path("v.png")), StartsWith("\x89PNG"));
  ASSERT_EQ(Transfer({"-o", Path("t.obj"), "--view", Path("v.html")}).exit_code, 0);
  EXPECT_THAT(Content(Path("v.html")), HasSubstr("reference"));
  ASSERT_EQ(
      Run({"render", Path("source.obj"), Path("t.obj"), "-o", Path("r.png"), "--captions", "before", "after"})
          .exit_code,
      0);
  EXPECT_THAT(Content(Path("r.png")), StartsWith("\x89PNG"));
}

TEST_F(CliTest, RigWritesASkinnedGlbAndJson) {
  const ProgramResult result = Run({"rig", Path("source.obj"), "--server", server_->address(), "-o",
                                    Path("rig.glb"), "-o", Path("rig.json")});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const TriangleMesh mesh = Read(Path("rig.glb"));
  ASSERT_EQ(mesh.vertex_count(), source_.vertex_count());
  EXPECT_LT((mesh.positions - source_.positions).cwiseAbs().maxCoeff(), 1e-6f);
  EXPECT_THAT(Content(Path("rig.glb")), AllOf(HasSubstr("JOINTS_0"), HasSubstr("left_hip")));
  const auto rig = nlohmann::json::parse(Content(Path("rig.json")));
  EXPECT_EQ(rig["vertex_count"], source_.vertex_count());
  EXPECT_EQ(rig["joint_count"], 24);
  EXPECT_THAT(rig["joints"], SizeIs(24));
  EXPECT_EQ(rig["weights"].size(), rig["row_offsets"].back().get<size_t>());
}

TEST_F(CliTest, SummaryIsTextJsonOrNothing) {
  EXPECT_THAT(Transfer({"-o", Path("t.obj"), "--quiet"}).out, IsEmpty());
  const auto json = nlohmann::json::parse(Transfer({"-o", Path("t.obj"), "--json"}).out);
  EXPECT_EQ(json["vertices"], source_.vertex_count());
  EXPECT_EQ(json["outputs"], nlohmann::json({Path("t.obj")}));
  EXPECT_EQ(json["model"], "untrained-stance");
  EXPECT_FALSE(json["request_id"].get<std::string>().empty());
  EXPECT_GT(json["seconds"]["total"].get<double>(), 0.0);
}

TEST_F(CliTest, TheMethodIsTheServersUnlessChosen) {
  const auto model = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words = {"-o", Path("t.obj"), "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return nlohmann::json::parse(Transfer(words).out)["model"].get<std::string>();
  };
  EXPECT_EQ(model({}), "untrained-stance");
  EXPECT_EQ(model({"--method", "stance"}), "untrained-stance");
  EXPECT_EQ(model({"--method", "skeletal"}), "untrained");
  EXPECT_EQ(model({"--model", "untrained"}), "untrained");
  const ProgramResult local =
      Run({"transfer", Path("source.obj"), Path("reference.ply"), "--local", "--model",
           STANCE_UNTRAINED_MODEL, "--method", "stance", "-o", Path("t.obj")});
  EXPECT_EQ(local.exit_code, 3);
  ExpectOneErrorLine(local);
  EXPECT_THAT(local.err, HasSubstr("'stance' has no model here; loaded: skeletal"));
}

TEST_F(CliTest, BelowMinConfidenceTheExitCodeIs6AndTheOutputsAreWritten) {
  const ProgramResult sure = Transfer({"-o", Path("t.obj"), "--skeleton", Path("s.json"), "--json"});
  ASSERT_EQ(sure.exit_code, 0) << sure.err;
  const double confidence = nlohmann::json::parse(sure.out)["confidence"].get<double>();
  EXPECT_GT(confidence, 0);
  EXPECT_LT(confidence, 1);
  const auto skeleton = nlohmann::json::parse(Content(Path("s.json")));
  EXPECT_THAT(skeleton["confidence"]["source"], SizeIs(24));
  EXPECT_THAT(skeleton["confidence"]["reference"], SizeIs(24));
  EXPECT_EQ(Transfer({"-o", Path("t.obj"), "--min-confidence", std::to_string(0.5 * confidence)}).exit_code,
            0);

  const ProgramResult unsure = Transfer({"-o", Path("u.obj"), "--min-confidence", "1"});
  EXPECT_EQ(unsure.exit_code, 6);
  ExpectOneErrorLine(unsure);
  EXPECT_THAT(unsure.err, AllOf(HasSubstr("--min-confidence: the confidence is 0."),
                                HasSubstr("less than 1; the outputs were written")));
  EXPECT_THAT(unsure.out, HasSubstr("\nconfidence 0."));
  EXPECT_EQ(Read(Path("u.obj")).vertex_count(), source_.vertex_count());

  const ProgramResult unknown =
      Transfer({"-o", Path("v.obj"), "--model", "untrained", "--min-confidence", "0.01"});
  EXPECT_EQ(unknown.exit_code, 6);
  EXPECT_THAT(unknown.err, HasSubstr("model untrained does not know its confidence"));
  EXPECT_EQ(Read(Path("v.obj")).vertex_count(), source_.vertex_count());
}

TEST_F(CliTest, GroundPutsTheTargetAsLowAsTheSource) {
  const ProgramResult result = Transfer({"-o", Path("t.ply"), "--ground", "source", "--facing", "source"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_NEAR(Read(Path("t.ply")).positions.col(1).minCoeff(), source_.positions.col(1).minCoeff(), 1e-5f);
}

TEST_F(CliTest, AnimateWritesATargetForEachReference) {
  const testing::Puppet puppet = testing::MakePuppet();
  fs::create_directories(Path("poses"));
  fs::create_directories(Path("here"));
  fs::create_directories(Path("there"));
  for (int i = 0; i < 11; ++i) {  // more than the server has in flight
    Write(testing::Pose(puppet, testing::RandomPose(10 + static_cast<uint64_t>(i), 0.4)).mesh,
          "poses/pose" + std::to_string(i) + ".ply");
  }
  std::ofstream(Path("poses/readme.txt")) << "no mesh";
  const std::vector<std::string> words = {"animate", Path("source.obj"), Path("reference.ply"),
                                          Path("poses")};
  std::vector<std::string> remote = words, local = words;
  remote.insert(remote.end(), {"-o", Path("there"), "--server", server_->address()});
  local.insert(local.end(), {"-o", Path("here"), "--local", "--model", STANCE_UNTRAINED_MODEL, "--model",
                             STANCE_UNTRAINED_STANCE_MODEL});
  const ProgramResult result = Run(remote);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, IsEmpty());
  EXPECT_THAT(result.out, HasSubstr("wrote " + Path("there/pose10.obj") + "\n"));
  ASSERT_EQ(Run(local).exit_code, 0);
  ASSERT_EQ(Transfer({"-o", Path("target.obj")}).exit_code, 0);
  const TriangleMesh alone = Read(Path("target.obj"));
  EXPECT_LE((Read(Path("there/reference.obj")).positions - alone.positions).cwiseAbs().maxCoeff(), 1e-3f);
  for (int i = 0; i < 11; ++i) {
    const std::string name = "/pose" + std::to_string(i) + ".obj";
    const TriangleMesh a = Read(Path("here" + name)), b = Read(Path("there" + name));
    EXPECT_LE((a.positions - b.positions).cwiseAbs().maxCoeff(), 1e-3f);
    EXPECT_EQ(b.texcoords, source_.texcoords);
    EXPECT_FALSE(b.positions.isApprox(alone.positions, 1e-3f)) << "another reference's pose";
  }
}

TEST_F(CliTest, AnimateGoesOnAfterABadReference) {
  fs::create_directories(Path("out"));
  std::ofstream(Path("cut.off")) << "OFF 1 2 3 four";
  std::ofstream(Path("bad.off"))
      << "OFF\n3 0 0\n0 0 0\n1 0 0\n0 1 0\n";  // it can be read, but has no surface
  for (const bool local : {true, false}) {
    std::vector<std::string> words = {"animate",
                                      Path("source.obj"),
                                      Path("cut.off"),
                                      Path("bad.off"),
                                      Path("reference.ply"),
                                      "-o",
                                      Path("out"),
                                      "--format",
                                      "ply"};
    if (local) {
      words.insert(words.end(), {"--local", "--model", STANCE_UNTRAINED_MODEL});
    } else {
      words.insert(words.end(), {"--server", server_->address()});
    }
    const ProgramResult result = Run(words);
    EXPECT_EQ(result.exit_code, 3);
    EXPECT_THAT(result.err, HasSubstr("stance: " + Path("cut.off")));
    EXPECT_THAT(result.err, HasSubstr("stance: " + Path("bad.off") + ": reference: "));
    EXPECT_THAT(result.err, EndsWith("stance: 2 of 3 references failed\n"));
    EXPECT_EQ(result.out, "wrote " + Path("out/reference.ply") + "\n");
  }
  const auto twice = Run({"animate", Path("source.obj"), Path("reference.ply"), Path("reference.ply"), "-o",
                          Path("out"), "--local"});
  EXPECT_EQ(twice.exit_code, 2);
  ExpectOneErrorLine(twice);
  EXPECT_EQ(Run({"animate", Path("source.obj"), Path("out"), "-o", Path("none"), "--local"}).exit_code, 4);
}

TEST_F(CliTest, InfoCountsAndWarns) {
  Write(testing::WithDegenerateFaces(), "odd.ply");
  const ProgramResult text = Run({"info", Path("odd.ply")});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_THAT(text.out, AllOf(HasSubstr("83"), HasSubstr("warning: ")));
  const auto json = nlohmann::json::parse(Run({"info", Path("source.obj"), "--json"}).out);
  EXPECT_EQ(json["format"], "obj");
  EXPECT_EQ(json["vertices"], source_.vertex_count());
  EXPECT_EQ(json["faces"], source_.face_count());
  EXPECT_EQ(json["texcoords"], true);
  EXPECT_NEAR(json["bounds"]["max"][1].get<double>(), source_.positions.col(1).maxCoeff(), 1e-5);
}

TEST_F(CliTest, ServerInfoNamesTheModel) {
  const ProgramResult text = Run({"server-info", "--server", server_->address()});
  EXPECT_EQ(text.exit_code, 0) << text.err;
  EXPECT_THAT(text.out, AllOf(HasSubstr("untrained-stance 0: method stance, 24 joints"),
                              HasSubstr("methods     stance skeletal; default stance\n")));
  const auto json = nlohmann::json::parse(Run({"server-info", "--server", server_->address(), "--json"}).out);
  EXPECT_EQ(json["models"][0]["joint_count"], 24);
  EXPECT_EQ(json["models"][0]["method"], "stance");
  EXPECT_EQ(json["models"][1]["method"], "skeletal");
  EXPECT_EQ(json["models"][1]["parameter_count"], 3377691);
  EXPECT_EQ(json["default_method"], "stance");
  EXPECT_THAT(json["methods"], ::testing::Contains("skeletal"));
  EXPECT_THAT(json["formats"], ::testing::Contains("glb"));
  EXPECT_GT(json["limits"]["max_vertices"].get<int64_t>(), 0);
}

TEST_F(CliTest, UsageErrorsExitWith2) {
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{},
                                             {"dance"},
                                             {"transfer", Path("source.obj")},
                                             {"transfer", "a.obj", "b.obj", "-o", "c.fbx"},
                                             {"info", "a.obj", "--nope"}}) {
    const ProgramResult result = Run(words);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    ExpectOneErrorLine(result);
  }
  EXPECT_EQ(Run({"--help"}).exit_code, 0);
}

TEST_F(CliTest, BadInputExitsWith3AndNamesFileAndField) {
  {
    // Our own writer refuses such a mesh: one line of a good file is changed.
    std::ifstream good(Path("source.obj"));
    std::ofstream bad(Path("nan.obj"));
    int vertex = 0;
    for (std::string line; std::getline(good, line);) {
      bad << (line.starts_with("v ") && vertex++ == 5 ? "v 0 nan 0" : line) << '\n';
    }
  }
  std::ofstream(Path("text.glb")) << "not a GLB";
  std::ofstream(Path("mesh.xyz")) << "v 0 0 0";
  const struct {
    std::string source, reference, bad;
    std::vector<std::string> parts;
  } cases[] = {{"nan.obj", "reference.ply", "nan.obj", {"source", "5"}},
               {"source.obj", "nan.obj", "nan.obj", {"reference", "5"}},
               {"text.glb", "reference.ply", "text.glb", {}},
               {"source.obj", "mesh.xyz", "mesh.xyz", {}}};
  for (const auto& bad : cases) {
    const ProgramResult result = Transfer(bad.source, bad.reference, {"-o", Path("t.obj")});
    EXPECT_EQ(result.exit_code, 3) << result.err;
    ExpectOneErrorLine(result);
    EXPECT_THAT(result.err, HasSubstr(Path(bad.bad)));
    for (const std::string& part : bad.parts) EXPECT_THAT(result.err, HasSubstr(part));
    EXPECT_FALSE(fs::exists(Path("t.obj")));
  }
  const ProgramResult local = Run({"transfer", Path("nan.obj"), Path("reference.ply"), "-o", Path("t.obj"),
                                   "--local", "--model", STANCE_UNTRAINED_MODEL});
  EXPECT_EQ(local.exit_code, 3);
  EXPECT_THAT(local.err, AllOf(HasSubstr(Path("nan.obj")), HasSubstr("source")));
  EXPECT_EQ(Run({"info", Path("nan.obj")}).exit_code, 3);
  EXPECT_EQ(Run({"render", Path("nan.obj"), "-o", Path("r.png")}).exit_code, 3);
  const ProgramResult model = Transfer({"-o", Path("t.obj"), "--model", "nobody"});
  EXPECT_EQ(model.exit_code, 3);
  EXPECT_THAT(model.err, HasSubstr("nobody"));
}

TEST_F(CliTest, FileErrorsExitWith4AndNameTheFile) {
  const auto expect = [&](const ProgramResult& result, const std::string& path) {
    EXPECT_EQ(result.exit_code, 4) << result.err;
    ExpectOneErrorLine(result);
    EXPECT_THAT(result.err, HasSubstr(path));
  };
  expect(Transfer("none.obj", "reference.ply", {"-o", Path("t.obj")}), Path("none.obj"));
  expect(Transfer({"-o", Path("no/t.obj")}), Path("no/t.obj"));
  expect(Transfer({"-o", Path("t.obj"), "--skeleton", Path("no/s.json")}), Path("no/s.json"));
  expect(Run({"info", Path("none.obj")}), Path("none.obj"));
  expect(Run({"render", Path("source.obj"), "-o", Path("no/r.png")}), Path("no/r.png"));
  expect(Run({"transfer", Path("source.obj"), Path("reference.ply"), "-o", Path("t.obj"), "--local",
              "--model", Path("no_model")}),
         Path("no_model"));
  EXPECT_FALSE(fs::exists(Path("t.obj")));
}

TEST_F(CliTest, NoServerExitsWith5) {
  const std::string server = "unix:" + Path("none.sock");
  const ProgramResult result = Run({"transfer", Path("source.obj"), Path("reference.ply"), "--server", server,
                                    "--timeout", "0.2", "-o", Path("t.obj")});
  EXPECT_EQ(result.exit_code, 5) << result.err;
  ExpectOneErrorLine(result);
  EXPECT_THAT(result.err, HasSubstr(server));
  EXPECT_EQ(Run({"server-info", "--server", server, "--timeout", "0.2"}).exit_code, 5);
}

TEST_F(CliTest, AServerThatDoesNotAnswerExitsWith5AndServesAfterwards) {
  server_->Signal(SIGSTOP);
  const ProgramResult result = Transfer({"-o", Path("t.obj"), "--timeout", "0.3"});
  server_->Signal(SIGCONT);
  EXPECT_EQ(result.exit_code, 5) << result.err;
  ExpectOneErrorLine(result);
  EXPECT_FALSE(fs::exists(Path("t.obj")));
  EXPECT_EQ(Transfer({"-o", Path("t.obj")}).exit_code, 0);
}

TEST_F(CliTest, AFailureLeavesEveryOutputAsItWas) {
  std::ofstream(Path("t.obj")) << "old";
  std::ofstream(Path("bad.off")) << "OFF 1 2 3 four";
  const std::vector<std::string> before = Files();
  const std::vector<std::string> outputs = {"-o",         Path("t.obj"),  "-o",        Path("t.glb"),
                                            "--skeleton", Path("s.json"), "--weights", Path("w.csv")};
  EXPECT_EQ(Transfer("source.obj", "bad.off", outputs).exit_code, 3);
  std::vector<std::string> unwritable = outputs;
  unwritable.insert(unwritable.end(), {"-o", Path("no/t.ply")});
  EXPECT_EQ(Transfer("source.obj", "reference.ply", unwritable).exit_code, 4);
  EXPECT_EQ(Content(Path("t.obj")), "old");
  EXPECT_THAT(Files(), ::testing::UnorderedElementsAreArray(before));

  EXPECT_EQ(Transfer("source.obj", "reference.ply", outputs).exit_code, 0);
  EXPECT_EQ(Read(Path("t.obj")).vertex_count(), source_.vertex_count());
  EXPECT_THAT(Files(), SizeIs(before.size() + 3));
}

}  // namespace
}  // namespace stance

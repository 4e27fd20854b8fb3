#include "core/training/character_pack.h"

#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>
#include <string>
#include <utility>

#include "core/base/random.h"
#include "core/training/gzip.h"
#include "core/training/mpfb_body.h"
#include "tests/core/training/small_data.h"

namespace stance {
namespace {

constexpr size_t kHeader = 24;  // magic, version, raw size, checksum

CharacterPack SmallPack() {
  const testing::TemporaryFolder folder;
  testing::WriteSmallBody(folder.path());
  CharacterPack pack;
  auto body = ReadMpfbBody(folder.path());
  EXPECT_TRUE(body.ok()) << body.status();
  if (body.ok()) pack.body = *std::move(body);
  pack.clips = {{"walk", std::vector<int16_t>(2 * 4 * kHumanJoints, 7)}, {"", {}}};
  return pack;
}

// A pack with this content and a valid header.
std::string Wrapped(const std::string& raw) {
  std::string file = SerializePack({}).substr(0, kHeader);
  const std::string compressed = Compress(raw);
  const uint64_t size = raw.size();
  const auto checksum = static_cast<uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(compressed.data()), static_cast<uInt>(compressed.size())));
  std::memcpy(&file[12], &size, 8);
  std::memcpy(&file[20], &checksum, 4);
  return file + compressed;
}

std::string Raw(const std::string& pack) { return *Decompress(pack.substr(kHeader), 1 << 28); }

TEST(CharacterPack, RoundTripIsExact) {
  const CharacterPack pack = SmallPack();
  const auto read = ParsePack(SerializePack(pack));
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_EQ(read->body.vertex_count, pack.body.vertex_count);
  EXPECT_EQ(read->body.points, pack.body.points);
  EXPECT_EQ(read->body.weights, pack.body.weights);
  EXPECT_EQ(read->body.macro_count, pack.body.macro_count);
  ASSERT_EQ(read->body.morphs.size(), pack.body.morphs.size());
  for (size_t i = 0; i < pack.body.morphs.size(); ++i) {
    EXPECT_EQ(read->body.morphs[i].factors, pack.body.morphs[i].factors);
    EXPECT_EQ(read->body.morphs[i].points, pack.body.morphs[i].points);
    EXPECT_EQ(read->body.morphs[i].deltas, pack.body.morphs[i].deltas);
  }
  ASSERT_EQ(read->body.levels.size(), pack.body.levels.size());
  for (size_t i = 0; i < pack.body.levels.size(); ++i) {
    EXPECT_EQ(read->body.levels[i].vertices, pack.body.levels[i].vertices);
    EXPECT_EQ(read->body.levels[i].faces, pack.body.levels[i].faces);
  }
  ASSERT_EQ(read->clips.size(), 2u);
  EXPECT_EQ(read->clips[0].name, "walk");
  EXPECT_EQ(read->clips[0].quaternions, pack.clips[0].quaternions);
}

TEST(CharacterPack, ExtremeDeltasSurvive) {
  CharacterPack pack = SmallPack();
  auto& deltas = pack.body.morphs[0].deltas;
  for (size_t i = 0; i < deltas.size(); ++i) deltas[i] = i % 2 == 0 ? -32768 : 32767;
  const auto read = ParsePack(SerializePack(pack));
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read->body.morphs[0].deltas, deltas);
}

// A tetrahedron, all that a pack asks of a rigged body.
RiggedBody SmallRigged(const std::string& name, bool held_out) {
  RiggedBody body;
  body.name = name;
  body.held_out = held_out;
  body.rest.positions = Points::Zero(4, 3);
  body.rest.positions.bottomRows(3).diagonal().setConstant(kMorphUnit * 17000);
  body.rest.positions(0, 0) = kMorphUnit * -12345;
  body.rest.joints = Points::Random(kHumanJoints, 3);
  body.rest.stature = 1.7;
  body.faces.resize(4, 3);
  body.faces << 0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3;
  body.weights = RowMatrix::Zero(4, kHumanJoints);
  body.weights.col(kHead).setConstant(200.0f / kWeightSteps);
  body.weights.col(kNeck).setConstant(55.0f / kWeightSteps);
  return body;
}

TEST(CharacterPack, RiggedBodiesSurviveExactly) {
  CharacterPack pack = SmallPack();
  pack.rigged = {SmallRigged("a/one", false), SmallRigged("a/two", true)};
  const auto read = ParsePack(SerializePack(pack));
  ASSERT_TRUE(read.ok()) << read.status();
  ASSERT_EQ(read->rigged.size(), 2u);
  for (size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(read->rigged[i].name, pack.rigged[i].name);
    EXPECT_EQ(read->rigged[i].held_out, pack.rigged[i].held_out);
    EXPECT_EQ(read->rigged[i].rest.positions, pack.rigged[i].rest.positions);
    EXPECT_EQ(read->rigged[i].rest.joints, pack.rigged[i].rest.joints);
    EXPECT_EQ(read->rigged[i].rest.stature, pack.rigged[i].rest.stature);
    EXPECT_EQ(read->rigged[i].faces, pack.rigged[i].faces);
    EXPECT_EQ(read->rigged[i].weights, pack.rigged[i].weights);
  }
}

TEST(CharacterPack, DamagedRiggedBodiesAreDataLoss) {
  CharacterPack pack = SmallPack();
  pack.rigged = {SmallRigged("a/one", false)};
  const std::string raw = Raw(SerializePack(pack));
  const size_t begin = Raw(SerializePack(SmallPack())).size();
  Random random(3);
  for (int i = 0; i < 50; ++i) {
    EXPECT_EQ(ParsePack(Wrapped(raw.substr(0, begin + random.Below(raw.size() - begin)))).status().code(),
              absl::StatusCode::kDataLoss);
    std::string damaged = raw;
    damaged[begin + random.Below(raw.size() - begin)] = static_cast<char>(random.Below(256));
    const auto read = ParsePack(Wrapped(damaged));
    for (size_t k = 0; read.ok() && k < read->rigged.size(); ++k) {
      EXPECT_TRUE(CheckRiggedBody(read->rigged[k]).ok());
    }
  }
  pack.rigged[0].faces(0, 0) = 4;
  const auto read = ParsePack(SerializePack(pack));
  EXPECT_EQ(read.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_NE(std::string(read.status().message()).find("a/one"), std::string::npos);
}

TEST(CharacterPack, VersionOneHasNoRiggedBodies) {
  const std::string raw = Raw(SerializePack(SmallPack()));
  std::string old = Wrapped(raw.substr(0, raw.size() - 4));  // without their count
  old[8] = 1;
  const auto read = ParsePack(old);
  ASSERT_TRUE(read.ok()) << read.status();
  EXPECT_TRUE(read->rigged.empty());
  EXPECT_EQ(read->clips.size(), 2u);
}

TEST(CharacterPack, DamagedBytesAreDataLoss) {
  const std::string bytes = SerializePack(SmallPack());
  const auto code = [](const std::string& damaged) { return ParsePack(damaged).status().code(); };
  EXPECT_EQ(code(""), absl::StatusCode::kDataLoss);
  EXPECT_EQ(code("neither"), absl::StatusCode::kDataLoss);
  Random random(1);
  for (int i = 0; i < 60; ++i) {
    EXPECT_EQ(code(bytes.substr(0, random.Below(bytes.size()))), absl::StatusCode::kDataLoss);
    std::string flipped = bytes;
    flipped[random.Below(flipped.size())] ^= static_cast<char>(1 << random.Below(8));
    EXPECT_EQ(code(flipped), absl::StatusCode::kDataLoss);
    std::string noise(random.Below(5000), '\0');
    for (char& c : noise) c = static_cast<char>(random.Below(256));
    EXPECT_EQ(code(noise), absl::StatusCode::kDataLoss);
    EXPECT_EQ(code(bytes.substr(0, 8) + noise), absl::StatusCode::kDataLoss);
  }
}

// Behind a right checksum too: the parser itself must hold.
TEST(CharacterPack, DamagedContentNeverCrashes) {
  const std::string raw = Raw(SerializePack(SmallPack()));
  Random random(2);
  for (int i = 0; i < 25; ++i) {
    EXPECT_EQ(ParsePack(Wrapped(raw.substr(0, random.Below(raw.size())))).status().code(),
              absl::StatusCode::kDataLoss);
  }
  int rejected = 0;
  for (int i = 0; i < 25; ++i) {
    std::string damaged = raw;
    for (int k = 0; k < 200; ++k)
      damaged[random.Below(damaged.size())] = static_cast<char>(random.Below(256));
    const auto pack = ParsePack(Wrapped(damaged));
    if (pack.ok()) {
      EXPECT_TRUE(CheckBodyData(pack->body).ok());
    } else {
      EXPECT_EQ(pack.status().code(), absl::StatusCode::kDataLoss);
      ++rejected;
    }
  }
  EXPECT_GT(rejected, 0);
  EXPECT_EQ(ParsePack(Wrapped(raw + "x")).status().code(), absl::StatusCode::kDataLoss);
  for (int i = 0; i < 200; ++i) {  // counts at the front that promise more than there is
    std::string noise(random.Below(200), '\0');
    for (char& c : noise) c = static_cast<char>(random.Below(256));
    EXPECT_EQ(ParsePack(Wrapped(noise)).status().code(), absl::StatusCode::kDataLoss);
  }
}

TEST(CharacterPack, AnotherVersionIsNamed) {
  std::string bytes = SerializePack(SmallPack());
  bytes[8] = 9;
  const auto pack = ParsePack(bytes);
  EXPECT_EQ(pack.status().code(), absl::StatusCode::kDataLoss);
  EXPECT_NE(std::string(pack.status().message()).find("version 9"), std::string::npos);
}

// Found before a row of 24 weights is allocated for each of four billion vertices.
TEST(CharacterPack, CountsThatNoBodyHasAreDataLoss) {
  std::string raw = Raw(SerializePack(SmallPack()));
  for (const auto& [vertices, points] : {std::pair{100u, 70'000u}, std::pair{100u, 100u}}) {
    std::memcpy(raw.data(), &vertices, 4);
    std::memcpy(raw.data() + 4, &points, 4);
    const auto pack = ParsePack(Wrapped(raw));
    EXPECT_EQ(pack.status().code(), absl::StatusCode::kDataLoss);
    EXPECT_NE(std::string(pack.status().message()).find("100 vertices among"), std::string::npos);
  }
}

}  // namespace
}  // namespace stance

#include "core/training/character_pack.h"

#include <fmt/format.h>
#include <zlib.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <type_traits>
#include <utility>

#include "core/base/check.h"
#include "core/training/gzip.h"

namespace stance {
namespace {

static_assert(std::endian::native == std::endian::little, "the pack is written as it lies in memory");

constexpr std::string_view kMagic = "STANCEPK";
constexpr uint32_t kVersion = 2;
constexpr uint32_t kVersionWithoutRigged = 1;
constexpr size_t kHeaderBytes = 8 + 4 + 8 + 4;
constexpr uint64_t kMaxRawBytes = uint64_t{1} << 30;  // MPFB's body has 60 MB

class Writer {
 public:
  template <typename T>
  void Put(T value) {
    static_assert(std::is_arithmetic_v<T>);
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof(T));
  }
  template <typename T>
  void PutArray(const T* values, size_t count) {
    bytes_.append(reinterpret_cast<const char*>(values), count * sizeof(T));
  }
  template <typename T>
  void PutSized(const std::vector<T>& values) {
    Put<uint32_t>(static_cast<uint32_t>(values.size()));
    PutArray(values.data(), values.size());
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
};

// Every read past the end gives zeros and is remembered; the caller asks once, at the end.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}

  template <typename T>
  T Get() {
    T value{};
    GetArray(&value, 1);
    return value;
  }
  template <typename T>
  void GetArray(T* values, size_t count) {
    if (count == 0 || !Has(count, sizeof(T))) return;  // an empty array may have no place to copy to
    std::memcpy(values, bytes_.data(), count * sizeof(T));
    bytes_.remove_prefix(count * sizeof(T));
  }
  template <typename T>
  std::vector<T> GetSized() {
    const size_t count = Get<uint32_t>();
    if (!Has(count, sizeof(T))) return {};
    std::vector<T> values(count);
    GetArray(values.data(), count);
    return values;
  }
  // Whether `count` items of at least `size` bytes can still come; from now on failed if not.
  bool Has(size_t count, size_t size) {
    failed_ = failed_ || count > bytes_.size() / size;
    return !failed_;
  }
  bool finished() const { return !failed_ && bytes_.empty(); }
  bool failed() const { return failed_; }

 private:
  std::string_view bytes_;
  bool failed_ = false;
};

// Signed values near zero to unsigned values near zero.
uint16_t ZigZag(int16_t value) { return static_cast<uint16_t>((value << 1) ^ (value >> 15)); }
int16_t UnZigZag(uint16_t value) { return static_cast<int16_t>((value >> 1) ^ -(value & 1)); }

// Rows of three as differences from one row to the next, one column after the other, low bytes apart from
// high ones: neighbours in a mesh's order are alike, so zlib finds mostly small numbers.
void PutRows(Writer& writer, const std::vector<int16_t>& rows) {
  const size_t count = rows.size() / 3;
  std::vector<uint8_t> planes(6 * count);
  for (size_t c = 0; c < 3; ++c) {
    uint16_t last = 0;
    for (size_t i = 0; i < count; ++i) {
      const auto value = static_cast<uint16_t>(rows[3 * i + c]);
      const uint16_t coded = ZigZag(static_cast<int16_t>(value - last));
      planes[2 * c * count + i] = static_cast<uint8_t>(coded & 255);
      planes[(2 * c + 1) * count + i] = static_cast<uint8_t>(coded >> 8);
      last = value;
    }
  }
  writer.PutArray(planes.data(), planes.size());
}

// `count` rows; none where the bytes end too soon.
std::vector<int16_t> GetRows(Reader& reader, size_t count) {
  if (!reader.Has(count, 6)) return {};
  std::vector<uint8_t> planes(6 * count);
  reader.GetArray(planes.data(), planes.size());
  std::vector<int16_t> rows(3 * count);
  for (size_t c = 0; c < 3; ++c) {
    uint16_t last = 0;
    for (size_t i = 0; i < count; ++i) {
      const auto coded =
          static_cast<uint16_t>(planes[2 * c * count + i] | (planes[(2 * c + 1) * count + i] << 8));
      last = static_cast<uint16_t>(last + static_cast<uint16_t>(UnZigZag(coded)));
      rows[3 * i + c] = static_cast<int16_t>(last);
    }
  }
  return rows;
}

void PutBody(Writer& writer, const BodyData& body) {
  writer.Put<uint32_t>(static_cast<uint32_t>(body.vertex_count));
  writer.Put<uint32_t>(static_cast<uint32_t>(body.points.rows()));
  writer.PutArray(body.points.data(), static_cast<size_t>(body.points.size()));
  for (Eigen::Index v = 0; v < body.weights.rows(); ++v) {
    writer.Put<uint8_t>(static_cast<uint8_t>((body.weights.row(v).array() != 0).count()));
    for (int j = 0; j < kHumanJoints; ++j) {
      if (body.weights(v, j) == 0) continue;
      writer.Put<uint8_t>(static_cast<uint8_t>(j));
      writer.Put<float>(body.weights(v, j));
    }
  }
  writer.Put<uint32_t>(static_cast<uint32_t>(body.levels.size()));
  for (const BodyTopology& level : body.levels) {
    writer.PutSized(level.vertices);
    writer.Put<uint32_t>(static_cast<uint32_t>(level.faces.rows()));
    writer.PutArray(level.faces.data(), static_cast<size_t>(level.faces.size()));
  }
  writer.Put<uint32_t>(static_cast<uint32_t>(body.macro_count));
  writer.Put<uint32_t>(static_cast<uint32_t>(body.morphs.size()));
  for (const MorphTarget& morph : body.morphs) {
    writer.PutSized(morph.factors);
    writer.Put<uint32_t>(static_cast<uint32_t>(morph.points.size()));
    uint16_t last = 0;
    for (const uint16_t point : morph.points) {
      writer.Put<uint16_t>(static_cast<uint16_t>(point - last));
      last = point;
    }
    PutRows(writer, morph.deltas);
  }
}

// DATA_LOSS for counts that no body has; the reader remembers bytes that end too soon.
absl::Status GetBody(Reader& reader, BodyData& body) {
  const size_t vertices = reader.Get<uint32_t>();
  const size_t points = reader.Get<uint32_t>();
  // Before anything is allocated: a vertex takes one byte here, but a row of 24 weights in memory.
  if (points > size_t{kMaxBodyPoints} || vertices >= points) {
    return absl::DataLossError(fmt::format("character pack: {} vertices among {} points", vertices, points));
  }
  if (!reader.Has(points, 12) || !reader.Has(vertices, 1)) return absl::OkStatus();
  body.vertex_count = static_cast<int>(vertices);
  body.points.resize(static_cast<Eigen::Index>(points), 3);
  reader.GetArray(body.points.data(), 3 * points);
  if (!reader.Has(vertices, 1)) return absl::OkStatus();
  body.weights = RowMatrix::Zero(static_cast<Eigen::Index>(vertices), kHumanJoints);
  for (size_t v = 0; v < vertices; ++v) {
    for (int i = reader.Get<uint8_t>(); i > 0; --i) {
      const auto joint = reader.Get<uint8_t>();
      const auto weight = reader.Get<float>();
      // A joint out of range leaves its row short of 1, which CheckBodyData refuses.
      if (joint < kHumanJoints) body.weights(static_cast<Eigen::Index>(v), joint) = weight;
    }
  }
  for (uint32_t count = reader.Get<uint32_t>(); count > 0 && !reader.failed(); --count) {
    BodyTopology& level = body.levels.emplace_back();
    level.vertices = reader.GetSized<int32_t>();
    const size_t faces = reader.Get<uint32_t>();
    if (!reader.Has(faces, 12)) return absl::OkStatus();
    level.faces.resize(static_cast<Eigen::Index>(faces), 3);
    reader.GetArray(level.faces.data(), 3 * faces);
  }
  body.macro_count = static_cast<int>(reader.Get<uint32_t>());
  for (uint32_t count = reader.Get<uint32_t>(); count > 0 && !reader.failed(); --count) {
    MorphTarget& morph = body.morphs.emplace_back();
    morph.factors = reader.GetSized<uint8_t>();
    morph.points = reader.GetSized<uint16_t>();
    for (size_t i = 1; i < morph.points.size(); ++i) {
      morph.points[i] = static_cast<uint16_t>(morph.points[i] + morph.points[i - 1]);
    }
    morph.deltas = GetRows(reader, morph.points.size());
  }
  return absl::OkStatus();
}

void PutRigged(Writer& writer, const RiggedBody& body) {
  writer.PutSized(std::vector<char>(body.name.begin(), body.name.end()));
  writer.Put<uint8_t>(body.held_out ? 1 : 0);
  writer.Put<double>(body.rest.stature);
  writer.PutArray(body.rest.joints.data(), 3 * kHumanJoints);
  const Points& positions = body.rest.positions;
  writer.Put<uint32_t>(static_cast<uint32_t>(positions.rows()));
  writer.Put<uint32_t>(static_cast<uint32_t>(body.faces.rows()));
  std::vector<int16_t> rows(static_cast<size_t>(positions.size()));
  std::transform(positions.data(), positions.data() + positions.size(), rows.begin(),
                 [](float x) { return static_cast<int16_t>(std::lround(x / kMorphUnit)); });
  PutRows(writer, rows);
  // Indices in 16 bits, whatever the sign.
  PutRows(writer, {body.faces.data(), body.faces.data() + body.faces.size()});
  for (Eigen::Index v = 0; v < body.weights.rows(); ++v) {
    writer.Put<uint8_t>(static_cast<uint8_t>((body.weights.row(v).array() != 0).count()));
    for (int j = 0; j < kHumanJoints; ++j) {
      if (body.weights(v, j) == 0) continue;
      writer.Put<uint8_t>(static_cast<uint8_t>(j));
      writer.Put<uint8_t>(static_cast<uint8_t>(std::lround(body.weights(v, j) * kWeightSteps)));
    }
  }
}

// DATA_LOSS for a body that CheckRiggedBody refuses; the reader remembers bytes that end too soon.
absl::Status GetRigged(Reader& reader, RiggedBody& body) {
  const std::vector<char> name = reader.GetSized<char>();
  body.name.assign(name.begin(), name.end());
  body.held_out = reader.Get<uint8_t>() != 0;
  body.rest.stature = reader.Get<double>();
  body.rest.joints = Points::Zero(kHumanJoints, 3);
  reader.GetArray(body.rest.joints.data(), 3 * kHumanJoints);
  const size_t vertices = reader.Get<uint32_t>();
  const size_t faces = reader.Get<uint32_t>();
  const std::vector<int16_t> rows = GetRows(reader, vertices);
  const std::vector<int16_t> corners = GetRows(reader, faces);
  if (!reader.Has(vertices, 1)) return absl::OkStatus();
  // Before a row of 24 weights is allocated for each.
  if (vertices > size_t{kMaxRiggedVertices}) {
    return absl::DataLossError(fmt::format("character pack: {} vertices of {}", vertices, body.name));
  }
  body.rest.positions.resize(static_cast<Eigen::Index>(vertices), 3);
  std::transform(rows.begin(), rows.end(), body.rest.positions.data(),
                 [](int16_t x) { return kMorphUnit * static_cast<float>(x); });
  body.faces.resize(static_cast<Eigen::Index>(faces), 3);
  std::transform(corners.begin(), corners.end(), body.faces.data(),
                 [](int16_t corner) { return static_cast<uint16_t>(corner); });
  body.weights = RowMatrix::Zero(static_cast<Eigen::Index>(vertices), kHumanJoints);
  for (size_t v = 0; v < vertices; ++v) {
    for (int i = reader.Get<uint8_t>(); i > 0; --i) {
      const auto joint = reader.Get<uint8_t>();
      const auto steps = reader.Get<uint8_t>();
      // A joint out of range leaves its row short of 1, which CheckRiggedBody refuses.
      if (joint < kHumanJoints) {
        body.weights(static_cast<Eigen::Index>(v), joint) = static_cast<float>(steps) / kWeightSteps;
      }
    }
  }
  if (reader.failed()) return absl::OkStatus();
  if (const absl::Status status = CheckRiggedBody(body); !status.ok()) {
    return absl::DataLossError(fmt::format("character pack: {}", std::string(status.message())));
  }
  return absl::OkStatus();
}

}  // namespace

std::string SerializePack(const CharacterPack& pack) {
  Writer content;
  PutBody(content, pack.body);
  content.Put<uint32_t>(static_cast<uint32_t>(pack.clips.size()));
  for (const MotionClip& clip : pack.clips) {
    content.Put<uint32_t>(static_cast<uint32_t>(clip.name.size()));
    content.PutArray(clip.name.data(), clip.name.size());
    content.PutSized(clip.quaternions);
  }
  content.Put<uint32_t>(static_cast<uint32_t>(pack.rigged.size()));
  for (const RiggedBody& body : pack.rigged) PutRigged(content, body);
  const std::string compressed = Compress(content.bytes());
  Writer file;
  file.PutArray(kMagic.data(), kMagic.size());
  file.Put<uint32_t>(kVersion);
  file.Put<uint64_t>(content.bytes().size());
  file.Put<uint32_t>(static_cast<uint32_t>(
      crc32(0, reinterpret_cast<const Bytef*>(compressed.data()), static_cast<uInt>(compressed.size()))));
  return file.bytes() + compressed;
}

absl::StatusOr<CharacterPack> ParsePack(std::string_view bytes) {
  if (bytes.size() < kHeaderBytes || bytes.substr(0, kMagic.size()) != kMagic) {
    return absl::DataLossError("not a character pack");
  }
  Reader header(bytes.substr(kMagic.size(), kHeaderBytes - kMagic.size()));
  const auto version = header.Get<uint32_t>();
  const auto raw_size = header.Get<uint64_t>();
  const auto checksum = header.Get<uint32_t>();
  if (version != kVersion && version != kVersionWithoutRigged) {
    return absl::DataLossError(fmt::format("character pack of version {}, expected {} or {}", version,
                                           kVersionWithoutRigged, kVersion));
  }
  const std::string_view compressed = bytes.substr(kHeaderBytes);
  if (raw_size > kMaxRawBytes || checksum != crc32(0, reinterpret_cast<const Bytef*>(compressed.data()),
                                                   static_cast<uInt>(compressed.size()))) {
    return absl::DataLossError("character pack: checksum mismatch");
  }
  STANCE_ASSIGN_OR_RETURN(const std::string raw, Decompress(compressed, raw_size));

  Reader reader(raw);
  CharacterPack pack;
  STANCE_RETURN_IF_ERROR(GetBody(reader, pack.body));
  for (uint32_t count = reader.Get<uint32_t>(); count > 0 && !reader.failed(); --count) {
    MotionClip& clip = pack.clips.emplace_back();
    const std::vector<char> name = reader.GetSized<char>();
    clip.name.assign(name.begin(), name.end());
    clip.quaternions = reader.GetSized<int16_t>();
    if (clip.quaternions.size() % (4 * kHumanJoints) != 0) {
      return absl::DataLossError(fmt::format("character pack: clip {} has a broken frame", clip.name));
    }
  }
  const uint32_t rigged = version == kVersionWithoutRigged ? 0 : reader.Get<uint32_t>();
  for (uint32_t count = rigged; count > 0 && !reader.failed(); --count) {
    STANCE_RETURN_IF_ERROR(GetRigged(reader, pack.rigged.emplace_back()));
  }
  if (!reader.finished()) return absl::DataLossError("character pack: truncated or with surplus bytes");
  if (const absl::Status status = CheckBodyData(pack.body); !status.ok()) {
    return absl::DataLossError(fmt::format("character pack: {}", std::string(status.message())));
  }
  return pack;
}

}  // namespace stance

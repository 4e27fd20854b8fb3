// The character generator's data as one compact file.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "core/base/status.h"
#include "core/training/body_data.h"
#include "core/training/motion_library.h"
#include "core/training/rigged_body.h"

namespace stance {

struct CharacterPack {
  BodyData body;
  std::vector<MotionClip> clips;
  std::vector<RiggedBody> rigged;
};

// Layout, little-endian: the magic "STANCEPK", u32 version, u64 raw size, u32 CRC-32 of the rest, then the
// content as a zlib stream. Version 1, which has no rigged bodies, is still read.
std::string SerializePack(const CharacterPack& pack);

// The pack that SerializePack wrote, bit for bit. DATA_LOSS for anything else: never crashes, never allocates
// more than a small multiple of what the stream holds.
absl::StatusOr<CharacterPack> ParsePack(std::string_view bytes);

}  // namespace stance

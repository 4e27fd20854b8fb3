// MakeHuman's parametric body (CC0) from MPFB's data folder.
#pragma once

#include <filesystem>

#include "core/base/status.h"
#include "core/training/body_data.h"

namespace stance {

// Reads 3dobjs/base.obj, rigs/standard/{rig,weights}.mixamo.json and targets/ below `mpfb_dir`: the macro
// morphs from child to old, and the local morph pairs of the body (not of the face). Takes seconds.
// NOT_FOUND, with the path, for a missing file; INVALID_ARGUMENT or DATA_LOSS for one that can't be read.
absl::StatusOr<BodyData> ReadMpfbBody(const std::filesystem::path& mpfb_dir);

}  // namespace stance

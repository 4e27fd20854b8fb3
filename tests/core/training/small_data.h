// A small set of training data in MPFB's and BVH's formats, written by the test, so that the real readers run
// where the real data isn't at hand.
#pragma once

#include <filesystem>
#include <string>

#include "core/base/types.h"

namespace stance::testing {

// A folder that goes away with the object.
class TemporaryFolder {
 public:
  TemporaryFolder();
  ~TemporaryFolder();
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

inline constexpr int kSmallBodyVertices = 15 * 12 * 10;

// A man of tubes in an A pose, 1.7 m, symmetric in x: base.obj with helpers behind the body's vertices, rig
// and weights (sums from 0.4 to 1.2, fingers apart), every macro target (a taller or wider body by its name)
// and two pairs of local ones. Below `folder`: 3dobjs/, rigs/, targets/.
void WriteSmallBody(const std::filesystem::path& folder);

// The joints (24, 3) that its rig means, metres.
Points SmallBodyJoints();

// The same with the arms laid along the x axis.
Points TPoseJoints();

// `clips` BVH files on the CMU skeleton's names, clip_00.bvh ..., each of a frame in the zero pose and five
// with every joint turned by up to 40 degrees.
void WriteSmallMotions(const std::filesystem::path& folder, int clips);

// The text of one of them.
std::string SmallMotion(uint64_t seed);

// Compresses and writes.
void WriteGzip(const std::filesystem::path& path, const std::string& text);

}  // namespace stance::testing

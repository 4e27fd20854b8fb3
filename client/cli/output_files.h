// The files that a command writes: all of them, whole, or none.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/status.h"

namespace stance {

// Each file is first written aside, as a hidden file in its own folder, so that a reader never sees half a
// file and a failure leaves what stood there before. Commit then renames them all; only a rename that fails
// after another has succeeded, which the checks before make unlikely, can leave some new and some old files.
class OutputFiles {
 public:
  OutputFiles() = default;
  OutputFiles(const OutputFiles&) = delete;
  OutputFiles& operator=(const OutputFiles&) = delete;
  // Removes what was staged and not committed.
  ~OutputFiles();

  // Whether `path` could be written, so that a command can say so before it works for seconds. NOT_FOUND,
  // PERMISSION_DENIED or FAILED_PRECONDITION with the path: its folder does not exist or can't be written, or
  // the path is something other than a regular file.
  static absl::Status Check(const std::filesystem::path& path);

  absl::Status Stage(const std::filesystem::path& path, std::string_view bytes);
  // The same, written by `write` to the path that it is given.
  absl::Status StageWith(const std::filesystem::path& path,
                         const std::function<absl::Status(const std::filesystem::path&)>& write);

  absl::Status Commit();

 private:
  struct Staged {
    std::filesystem::path aside;
    std::filesystem::path path;
  };
  std::vector<Staged> staged_;
};

}  // namespace stance

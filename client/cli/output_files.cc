#include "client/cli/output_files.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <fstream>
#include <system_error>

namespace stance {
namespace {

namespace fs = std::filesystem;

fs::path Folder(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

}  // namespace

OutputFiles::~OutputFiles() {
  std::error_code ignored;
  for (const Staged& file : staged_) fs::remove(file.aside, ignored);
}

absl::Status OutputFiles::Check(const fs::path& path) {
  std::error_code error;
  const fs::path folder = Folder(path);
  if (!fs::is_directory(folder, error)) {
    return absl::NotFoundError(
        fmt::format("{}: cannot be written: {} is not a folder", path.string(), folder.string()));
  }
  // Renaming over a device or a pipe would replace it.
  if (fs::exists(path, error) && !fs::is_regular_file(path, error)) {
    return absl::FailedPreconditionError(
        fmt::format("{}: cannot be written: it is not a regular file", path.string()));
  }
  if (access(folder.c_str(), W_OK) != 0) {
    return absl::PermissionDeniedError(
        fmt::format("{}: cannot be written: no permission for {}", path.string(), folder.string()));
  }
  return absl::OkStatus();
}

absl::Status OutputFiles::StageWith(const fs::path& path,
                                    const std::function<absl::Status(const fs::path&)>& write) {
  STANCE_RETURN_IF_ERROR(Check(path));
  const fs::path aside =
      Folder(path) / fmt::format(".{}.{}.part", path.filename().string(), static_cast<int>(getpid()));
  staged_.push_back({aside, path});
  return write(aside);
}

absl::Status OutputFiles::Stage(const fs::path& path, std::string_view bytes) {
  return StageWith(path, [&](const fs::path& aside) -> absl::Status {
    std::ofstream stream(aside, std::ios::binary | std::ios::trunc);
    stream.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    stream.close();
    if (stream.good()) return absl::OkStatus();
    return absl::DataLossError(
        fmt::format("{}: cannot be written: {}", path.string(), std::generic_category().message(errno)));
  });
}

absl::Status OutputFiles::Commit() {
  while (!staged_.empty()) {
    std::error_code error;
    fs::rename(staged_.front().aside, staged_.front().path, error);
    if (error) {
      return absl::DataLossError(
          fmt::format("{}: cannot be written: {}", staged_.front().path.string(), error.message()));
    }
    staged_.erase(staged_.begin());
  }
  return absl::OkStatus();
}

}  // namespace stance

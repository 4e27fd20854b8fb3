#include "core/base/files.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <sstream>

namespace stance {
namespace {

absl::Status FileError(const std::filesystem::path& path, int error) {
  const std::string text = fmt::format("{}: {}", path.string(), std::strerror(error));
  if (error == ENOENT || error == ENOTDIR) return absl::NotFoundError(text);
  if (error == EACCES || error == EPERM || error == EROFS) return absl::PermissionDeniedError(text);
  if (error == EISDIR) return absl::InvalidArgumentError(text);
  return absl::UnavailableError(text);
}

}  // namespace

absl::StatusOr<std::string> ReadFile(const std::filesystem::path& path) {
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) return FileError(path, EISDIR);
  errno = 0;
  std::ifstream in(path, std::ios::binary);
  if (!in) return FileError(path, errno ? errno : EIO);
  std::ostringstream bytes;
  bytes << in.rdbuf();
  if (in.bad()) return FileError(path, EIO);
  return std::move(bytes).str();
}

absl::Status WriteFile(const std::filesystem::path& path, std::string_view bytes) {
  std::filesystem::path aside = path;
  aside += fmt::format(".{}.tmp", getpid());
  errno = 0;
  {
    std::ofstream out(aside, std::ios::binary | std::ios::trunc);
    if (!out) return FileError(path, errno ? errno : EIO);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    out.close();
    if (!out) {
      const int error = errno ? errno : EIO;
      std::error_code ignored;
      std::filesystem::remove(aside, ignored);
      return FileError(path, error);
    }
  }
  std::error_code error;
  std::filesystem::rename(aside, path, error);
  if (error) {
    std::error_code ignored;
    std::filesystem::remove(aside, ignored);
    return FileError(path, error.value());
  }
  return absl::OkStatus();
}

}  // namespace stance

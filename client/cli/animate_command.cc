#include <fmt/format.h>

#include <algorithm>
#include <cstdio>
#include <deque>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "client/cli/backend.h"
#include "client/cli/commands.h"
#include "client/cli/exit_code.h"
#include "client/cli/input.h"
#include "client/cli/output_files.h"
#include "core/mesh/mesh_io.h"

namespace stance {
namespace {

namespace fs = std::filesystem;

// A reference's file and its target's.
struct Frame {
  std::string reference;
  std::string target;
};

// Files as they are named, folders as the meshes in them by name.
absl::StatusOr<std::vector<std::string>> ExpandFolders(const std::vector<std::string>& paths) {
  std::vector<std::string> files;
  for (const std::string& path : paths) {
    std::error_code error;
    if (!fs::is_directory(path, error)) {
      files.push_back(path);
      continue;
    }
    const auto first = std::ssize(files);
    for (const auto& entry : fs::directory_iterator(path, error)) {
      if (MeshFormatFromName(entry.path().string()).ok()) files.push_back(entry.path().string());
    }
    if (std::ssize(files) == first) {
      return FileError(absl::NotFoundError(fmt::format("{}: holds no mesh", path)));
    }
    std::sort(files.begin() + first, files.end());
  }
  return files;
}

absl::StatusOr<std::vector<Frame>> PlanFrames(const AnimateArguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(const std::vector<std::string> references, ExpandFolders(arguments.references));
  std::vector<Frame> frames;
  std::map<std::string, std::string> taken;  // target to reference
  for (const std::string& reference : references) {
    const std::string name = fs::path(reference).stem().string() + "." + arguments.format;
    const std::string target = (fs::path(arguments.output) / name).string();
    if (const auto [it, fresh] = taken.emplace(target, reference); !fresh) {
      return UsageError(absl::InvalidArgumentError(
          fmt::format("{}: the target of {} and of {}", target, it->second, reference)));
    }
    STANCE_RETURN_IF_ERROR(FileError(OutputFiles::Check(target)));
    frames.push_back({reference, target});
  }
  return frames;
}

// Reads the references while the answers to the former ones are written. Next and Take may run at the same
// time, each on one thread.
class Animation {
 public:
  Animation(std::vector<Frame> frames, bool quiet) : frames_(std::move(frames)), quiet_(quiet) {}

  // The next reference that can be read.
  std::optional<TriangleMesh> Next() {
    while (next_ < frames_.size()) {
      const Frame& frame = frames_[next_++];
      absl::StatusOr<TriangleMesh> mesh = ReadInput(frame.reference);
      std::lock_guard<std::mutex> guard(mutex_);
      if (mesh.ok()) {
        under_way_.push_back(&frame);
        return *std::move(mesh);
      }
      FailLocked(mesh.status());
    }
    return std::nullopt;
  }

  void Take(const absl::StatusOr<TransferAnswer>& answer) {
    const Frame* frame = nullptr;
    {
      std::lock_guard<std::mutex> guard(mutex_);
      frame = under_way_.front();
      under_way_.pop_front();
    }
    const absl::Status status = answer.ok() ? FileError(Write(*frame, answer->result.target))
                                            : NameFile(answer.status(), {{"reference", frame->reference}});
    std::lock_guard<std::mutex> guard(mutex_);
    if (!status.ok()) return FailLocked(status);
    if (!quiet_) std::printf("wrote %s\n", frame->target.c_str());
  }

  // The first failure's code, with how many there were.
  absl::Status Outcome() const {
    if (failures_ == 0) return absl::OkStatus();
    return WithText(first_failure_, fmt::format("{} of {} references failed", failures_, frames_.size()));
  }

 private:
  static absl::Status Write(const Frame& frame, const TriangleMesh& target) {
    STANCE_ASSIGN_OR_RETURN(const MeshFormat format, MeshFormatFromName(frame.target));
    STANCE_ASSIGN_OR_RETURN(const std::string bytes, SerializeMesh(target, format));
    OutputFiles files;
    STANCE_RETURN_IF_ERROR(files.Stage(frame.target, bytes));
    return files.Commit();
  }

  void FailLocked(const absl::Status& status) {
    if (failures_++ == 0) first_failure_ = status;
    std::fputs(ErrorLine("stance", status).c_str(), stderr);
  }

  const std::vector<Frame> frames_;
  const bool quiet_;
  size_t next_ = 0;  // of Next alone
  std::mutex mutex_;
  std::deque<const Frame*> under_way_;  // protected by mutex_, as are the next two
  int failures_ = 0;
  absl::Status first_failure_;
};

}  // namespace

absl::Status RunAnimate(const AnimateArguments& arguments) {
  STANCE_ASSIGN_OR_RETURN(std::vector<Frame> frames, PlanFrames(arguments));
  STANCE_ASSIGN_OR_RETURN(const TriangleMesh source, ReadInput(arguments.source));
  STANCE_ASSIGN_OR_RETURN(const std::unique_ptr<Backend> backend, MakeBackend(arguments.backend));
  Animation animation(std::move(frames), arguments.quiet);
  const absl::Status status = backend->Animate(
      source, arguments.options, [&] { return animation.Next(); },
      [&](const absl::StatusOr<TransferAnswer>& answer) { animation.Take(answer); });
  if (!status.ok()) return NameFile(status, {{"source", arguments.source}});
  return animation.Outcome();
}

}  // namespace stance

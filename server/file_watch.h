// Notices that a file was replaced or written.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <thread>

#include "core/base/status.h"

namespace stance {

// Calls back, on a thread of its own that sleeps while nothing happens, whenever a file in the folder of
// `path` has been written and closed, or renamed into its place. The folder and not the file is watched, as a
// careful writer replaces the file, and Kubernetes the symbolic link to the folder that holds it. On file
// systems of other machines the kernel may notice nothing.
class FileWatch {
 public:
  // `changed` may come without a change. UNAVAILABLE, naming the folder, if it can't be watched.
  static absl::StatusOr<std::unique_ptr<FileWatch>> Start(const std::string& path,
                                                          std::function<void()> changed);
  // Waits for a call under way.
  ~FileWatch();

 private:
  FileWatch(int notifier, int stopper, std::function<void()> changed);

  void Loop() const;

  const int notifier_;  // owned, as is stopper_, an eventfd that becomes readable at the end
  const int stopper_;
  const std::function<void()> changed_;
  std::jthread thread_;
};

}  // namespace stance

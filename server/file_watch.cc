#include "server/file_watch.h"

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/inotify.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

namespace stance {

absl::StatusOr<std::unique_ptr<FileWatch>> FileWatch::Start(const std::string& path,
                                                            std::function<void()> changed) {
  const std::filesystem::path parent = std::filesystem::path(path).parent_path();
  const char* folder = parent.empty() ? "." : parent.c_str();
  const int notifier = inotify_init1(IN_CLOEXEC | IN_NONBLOCK);
  // Not IN_CREATE: a file that was just made is not written yet.
  if (notifier < 0 || inotify_add_watch(notifier, folder, IN_CLOSE_WRITE | IN_MOVED_TO) < 0) {
    const int cause = errno;
    if (notifier >= 0) close(notifier);
    return absl::UnavailableError(fmt::format("{}: can't be watched: {}", folder, std::strerror(cause)));
  }
  const int stopper = eventfd(0, EFD_CLOEXEC);
  return std::unique_ptr<FileWatch>(new FileWatch(notifier, stopper, std::move(changed)));
}

FileWatch::FileWatch(int notifier, int stopper, std::function<void()> changed)
    : notifier_(notifier), stopper_(stopper), changed_(std::move(changed)), thread_([this] { Loop(); }) {}

FileWatch::~FileWatch() {
  const uint64_t one = 1;
  while (write(stopper_, &one, sizeof(one)) < 0 && errno == EINTR) {
  }
  thread_.join();
  close(notifier_);
  close(stopper_);
}

void FileWatch::Loop() const {
  while (true) {
    pollfd events[] = {{notifier_, POLLIN, 0}, {stopper_, POLLIN, 0}};
    if (poll(events, 2, -1) < 0) {
      if (errno != EINTR) return;
      continue;
    }
    if (events[1].revents != 0) return;
    // What happened does not matter, only that something did.
    alignas(inotify_event) char buffer[4096];
    while (read(notifier_, buffer, sizeof(buffer)) > 0) {
    }
    changed_();
  }
}

}  // namespace stance

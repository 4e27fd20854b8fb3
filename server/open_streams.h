// The streams that are open, to tell them of a drain.
#pragma once

#include <mutex>
#include <unordered_set>

namespace stance {

class DrainListener {
 public:
  // The stream is to accept nothing more, finish what it has accepted, and end. Must not Add or Remove.
  virtual void OnDrain() = 0;

 protected:
  ~DrainListener() = default;
};

// Thread-safe.
class OpenStreams {
 public:
  // False once the server drains: the stream is then not held, and must end.
  [[nodiscard]] bool Add(DrainListener* stream) {
    std::lock_guard<std::mutex> guard(mutex_);
    if (draining_) return false;
    streams_.insert(stream);
    return true;
  }
  // Returns when no OnDrain of the stream runs, or will.
  void Remove(DrainListener* stream) {
    std::lock_guard<std::mutex> guard(mutex_);
    streams_.erase(stream);
  }
  void Drain() {
    std::lock_guard<std::mutex> guard(mutex_);
    draining_ = true;
    for (DrainListener* stream : streams_) stream->OnDrain();
  }

 private:
  std::mutex mutex_;
  std::unordered_set<DrainListener*> streams_;  // protected by mutex_, as is draining_
  bool draining_ = false;
};

}  // namespace stance

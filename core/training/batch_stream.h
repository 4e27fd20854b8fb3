// Training batches made ahead of time on threads of their own.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

namespace stance {

// Batches from the character `first` on, `batch_size` characters each, in order. Not thread-safe itself.
template <typename Batch>
class BatchStream {
 public:
  // `make(first)` makes the batch that begins with that character; it runs on `threads` threads at the same
  // time and must not throw.
  BatchStream(std::function<Batch(int64_t)> make, int64_t first, int64_t batch_size, int threads)
      : make_(std::move(make)), batch_size_(batch_size), next_to_make_(first), next_to_give_(first) {
    for (int t = 0; t < threads; ++t) {
      threads_.emplace_back([this, ahead = 3 * threads * batch_size] { MakeAhead(ahead); });
    }
  }

  ~BatchStream() {
    {
      const std::lock_guard lock(mutex_);
      stop_ = true;
    }
    changed_.notify_all();
    threads_.clear();  // joins
  }

  Batch Next() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [&] { return ready_.contains(next_to_give_); });
    Batch batch = std::move(ready_.extract(next_to_give_).mapped());
    next_to_give_ += batch_size_;
    changed_.notify_all();
    return batch;
  }

 private:
  void MakeAhead(int64_t ahead) {
    std::unique_lock lock(mutex_);
    while (true) {
      changed_.wait(lock, [&] { return stop_ || next_to_make_ < next_to_give_ + ahead; });
      if (stop_) return;
      const int64_t first = next_to_make_;
      next_to_make_ += batch_size_;
      lock.unlock();
      Batch batch = make_(first);
      lock.lock();
      ready_.emplace(first, std::move(batch));
      changed_.notify_all();
    }
  }

  const std::function<Batch(int64_t)> make_;
  const int64_t batch_size_;
  std::mutex mutex_;
  std::condition_variable changed_;
  // Protected by mutex_: first characters, and the batches made by theirs.
  int64_t next_to_make_;
  int64_t next_to_give_;
  std::map<int64_t, Batch> ready_;
  bool stop_ = false;
  std::vector<std::jthread> threads_;
};

}  // namespace stance

// The models that are served, and their replacement while they are.
#pragma once

#include <condition_variable>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/base/status.h"
#include "server/metrics.h"
#include "server/model_source.h"

namespace stance {

// A reload loads the models beside those that are served, on one thread of the lowest priority, and puts them
// into their place when all is well; after any failure the former ones are served on. Reloads run one at a
// time: those that are asked for while one runs are one more after it, which sees what has changed since.
//
// Invariants: (1) `current` is never null, and never blocks for a reload; (2) a pipeline lives until its last
// user has let go of it; (3) names and methods stay those of the first, so that what was planned before a
// switch can be run after it; (4) every `done` is called exactly once, never under mutex_.
// Thread-safe.
class ModelRepository {
 public:
  // Told whether other models are served now than before, or why not: FAILED_PRECONDITION (RELOAD_FAILED) or
  // UNAVAILABLE (SHUTTING_DOWN).
  using Done = std::function<void(const absl::StatusOr<bool>& switched)>;

  // `metrics` outlives the repository.
  ModelRepository(std::unique_ptr<ModelSource> source, LoadedModels first, Metrics& metrics);
  // Closes.
  ~ModelRepository();

  std::shared_ptr<const Pipeline> current() const;

  // Begins a reload and returns. One that finds the files as they were when the present models were loaded
  // loads nothing. `done` is called on the repository's thread, or here once it is closed.
  void Reload(Done done);

  // Refuses reloads from now on and waits for the end of the one under way.
  void Close();

 private:
  void Loop();
  // One reload: logged and counted.
  absl::StatusOr<bool> Run();
  absl::StatusOr<bool> LoadAndSwitch();

  const std::unique_ptr<ModelSource> source_;
  Metrics& metrics_;
  std::string stamp_;  // of the present models; the thread's own

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  // Protected by mutex_:
  std::shared_ptr<const Pipeline> current_;
  std::vector<Done> waiting_;
  bool closed_ = false;

  std::jthread thread_;
};

}  // namespace stance

#include "server/model_repository.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/resource.h>

#include <utility>

#include "core/base/stopwatch.h"
#include "server/guarded.h"
#include "server/log.h"
#include "server/status_map.h"

namespace stance {
namespace {

constexpr int kLowestPriority = 19;

absl::Status Closed() {
  return WithReason(absl::UnavailableError("the server is shutting down"), "SHUTTING_DOWN");
}

// What requests may choose by: "stance 'one', skeletal 'two'".
std::string Served(const Pipeline& pipeline) {
  std::vector<std::string> texts;
  for (const ModelInfo& model : pipeline.models()) {
    texts.push_back(fmt::format("{} '{}'", MethodName(model.method), model.name));
  }
  return fmt::format("{}", fmt::join(texts, ", "));
}

std::vector<ModelLabels> LabelsOf(const Pipeline& pipeline) {
  std::vector<ModelLabels> labels;
  for (const ModelInfo& model : pipeline.models()) {
    labels.push_back({model.name, model.version, MethodName(model.method)});
  }
  return labels;
}

}  // namespace

ModelRepository::ModelRepository(std::unique_ptr<ModelSource> source, LoadedModels first, Metrics& metrics)
    : source_(std::move(source)),
      metrics_(metrics),
      stamp_(std::move(first.stamp)),
      current_(std::move(first.pipeline)) {
  metrics_.SetModels(LabelsOf(*current_));
  thread_ = std::jthread([this] { Loop(); });
}

ModelRepository::~ModelRepository() { Close(); }

std::shared_ptr<const Pipeline> ModelRepository::current() const {
  std::lock_guard<std::mutex> guard(mutex_);
  return current_;
}

void ModelRepository::Reload(Done done) {
  {
    std::lock_guard<std::mutex> guard(mutex_);
    if (!closed_) {
      waiting_.push_back(std::move(done));
      changed_.notify_one();
      return;
    }
  }
  done(Closed());
}

void ModelRepository::Close() {
  {
    std::lock_guard<std::mutex> guard(mutex_);
    closed_ = true;
    changed_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
}

void ModelRepository::Loop() {
  // On Linux that of this thread and of those that it starts. Anyone may lower it.
  setpriority(PRIO_PROCESS, 0, kLowestPriority);
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return closed_ || !waiting_.empty(); });
    const std::vector<Done> asked = std::exchange(waiting_, {});
    const bool closed = closed_;
    lock.unlock();
    if (!asked.empty()) {
      const absl::StatusOr<bool> switched = closed ? Closed() : Run();
      for (const Done& done : asked) done(switched);
    }
    if (closed) return;
    lock.lock();
  }
}

absl::StatusOr<bool> ModelRepository::Run() {
  Stopwatch watch;
  absl::StatusOr<bool> switched = false;
  const absl::Status status = Guarded("loading the models", [&] {
    switched = LoadAndSwitch();
    return switched.status();
  });
  if (!status.ok()) {
    metrics_.CountModelReload(ModelReload::kFailed);
    const std::string error(status.message());
    Log(LogLevel::kError, "models not reloaded", {{"error", error}, {"seconds", watch.Lap()}});
    return WithReason(absl::FailedPreconditionError(error), "RELOAD_FAILED");
  }
  metrics_.CountModelReload(*switched ? ModelReload::kSwitched : ModelReload::kUnchanged);
  std::vector<std::string> names;
  for (const ModelInfo& model : current()->models()) {
    names.push_back(fmt::format("{} {}", model.name, model.version));
  }
  Log(LogLevel::kInfo, *switched ? "models reloaded" : "models unchanged",
      {{"models", fmt::format("{}", fmt::join(names, ", "))}, {"seconds", watch.Lap()}});
  return switched;
}

absl::StatusOr<bool> ModelRepository::LoadAndSwitch() {
  STANCE_ASSIGN_OR_RETURN(LoadedModels loaded, source_->Load(stamp_));
  if (loaded.pipeline == nullptr) return false;
  const std::string before = Served(*current()), after = Served(*loaded.pipeline);
  if (before != after) {
    return absl::FailedPreconditionError(
        fmt::format("{} would be served in place of {}, which needs a restart", after, before));
  }
  metrics_.SetModels(LabelsOf(*loaded.pipeline));
  stamp_ = std::move(loaded.stamp);
  // Declared after `loaded`, so that the former pipeline is freed outside the lock.
  std::lock_guard<std::mutex> guard(mutex_);
  current_.swap(loaded.pipeline);
  return true;
}

}  // namespace stance

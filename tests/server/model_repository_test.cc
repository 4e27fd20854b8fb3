#include "server/model_repository.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <future>
#include <semaphore>
#include <stdexcept>
#include <utility>

#include "server/status_map.h"

namespace stance {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

ModelInfo Model(const std::string& name, const std::string& version) {
  ModelInfo model;
  model.name = name;
  model.version = version;
  return model;
}

class FakePipeline : public Pipeline {
 public:
  explicit FakePipeline(ModelInfo model, std::atomic<int>* alive = nullptr)
      : models_{std::move(model)}, alive_(alive) {
    if (alive_ != nullptr) ++*alive_;
  }
  ~FakePipeline() override {
    if (alive_ != nullptr) --*alive_;
  }
  std::vector<absl::StatusOr<TransferResult>> TransferBatch(std::span<const TransferJob>) const override {
    return {};
  }
  std::vector<absl::StatusOr<RigResult>> RigBatch(std::span<const RigJob>) const override { return {}; }
  std::vector<absl::StatusOr<RigSourceResult>> RigSources(std::span<const RigJob>) const override {
    return {};
  }
  absl::Status WarmUp() const override { return absl::OkStatus(); }
  const std::vector<ModelInfo>& models() const override { return models_; }
  const Skeleton& skeleton() const override { return HumanSkeleton(); }

 private:
  const std::vector<ModelInfo> models_;
  std::atomic<int>* const alive_;
};

// What a test puts on "disk".
class FakeDisk {
 public:
  void Put(const std::string& name, const std::string& version) {
    std::lock_guard<std::mutex> guard(mutex_);
    name_ = name;
    version_ = version;
    status_ = absl::OkStatus();
  }
  void Fail(const absl::Status& status) {
    std::lock_guard<std::mutex> guard(mutex_);
    status_ = status;
  }
  absl::StatusOr<LoadedModels> Load(const std::string& present) {
    std::lock_guard<std::mutex> guard(mutex_);
    ++loads;
    if (!status_.ok()) return status_;
    const std::string stamp = name_ + version_;
    if (stamp == present) return LoadedModels{nullptr, stamp};
    return LoadedModels{std::make_shared<FakePipeline>(Model(name_, version_), &alive), stamp};
  }

  std::atomic<int> loads = 0;
  std::atomic<int> alive = 0;  // pipelines

 private:
  std::mutex mutex_;
  std::string name_ = "one";
  std::string version_ = "1";
  absl::Status status_;
};

class FakeSource : public ModelSource {
 public:
  FakeSource(FakeDisk& disk, std::function<void()> before) : disk_(disk), before_(std::move(before)) {}
  absl::StatusOr<LoadedModels> Load(const std::string& present) const override {
    if (before_) before_();
    return disk_.Load(present);
  }

 private:
  FakeDisk& disk_;
  const std::function<void()> before_;
};

class ModelRepositoryTest : public ::testing::Test {
 protected:
  void Open(std::function<void()> before = nullptr) {
    repository_ = std::make_unique<ModelRepository>(std::make_unique<FakeSource>(disk_, std::move(before)),
                                                    disk_.Load("").value(), metrics_);
  }
  std::future<absl::StatusOr<bool>> Begin() {
    auto promise = std::make_shared<std::promise<absl::StatusOr<bool>>>();
    repository_->Reload([promise](const absl::StatusOr<bool>& switched) { promise->set_value(switched); });
    return promise->get_future();
  }
  absl::StatusOr<bool> Reload() { return Begin().get(); }
  std::string Version() const { return repository_->current()->models().front().version; }

  FakeDisk disk_;
  Metrics metrics_;
  std::unique_ptr<ModelRepository> repository_;
};

TEST_F(ModelRepositoryTest, SwitchesToWhatWasLoaded) {
  Open();
  disk_.Put("one", "2");
  EXPECT_EQ(Version(), "1");
  const auto switched = Reload();
  ASSERT_TRUE(switched.ok()) << switched.status();
  EXPECT_TRUE(*switched);
  EXPECT_EQ(Version(), "2");
  const std::string page = metrics_.Page();
  EXPECT_THAT(page, HasSubstr("stance_model_info{method=\"skeletal\",name=\"one\",version=\"2\"} 1"));
  EXPECT_THAT(page, Not(HasSubstr("version=\"1\"")));
  EXPECT_THAT(page, HasSubstr("stance_model_reloads_total{result=\"switched\"} 1"));
}

TEST_F(ModelRepositoryTest, WhatHasNotChangedIsNotLoaded) {
  Open();
  const auto before = repository_->current();
  const auto switched = Reload();
  ASSERT_TRUE(switched.ok()) << switched.status();
  EXPECT_FALSE(*switched);
  EXPECT_EQ(repository_->current(), before);
  EXPECT_THAT(metrics_.Page(), HasSubstr("stance_model_reloads_total{result=\"unchanged\"} 1"));
}

TEST_F(ModelRepositoryTest, AfterAFailureTheFormerIsServedOn) {
  Open();
  const auto before = repository_->current();
  disk_.Put("one", "2");
  disk_.Fail(absl::DataLossError("models/one/2: damaged"));
  const auto failed = Reload();
  EXPECT_EQ(failed.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_EQ(ReasonOf(failed.status()), "RELOAD_FAILED");
  EXPECT_THAT(std::string(failed.status().message()), HasSubstr("models/one/2: damaged"));
  EXPECT_EQ(repository_->current(), before);
  EXPECT_THAT(metrics_.Page(), HasSubstr("stance_model_reload_success 0"));
  // The same files are tried again.
  disk_.Put("one", "2");
  EXPECT_TRUE(Reload().value());
  EXPECT_EQ(Version(), "2");
  EXPECT_THAT(metrics_.Page(), HasSubstr("stance_model_reload_success 1"));
}

TEST_F(ModelRepositoryTest, AnExceptionIsAFailure) {
  std::atomic<bool> thrown = false;
  Open([&] {
    if (!thrown.exchange(true)) throw std::runtime_error("from a library");
  });
  EXPECT_THAT(std::string(Reload().status().message()), HasSubstr("from a library"));
  EXPECT_TRUE(Reload().ok());
}

TEST_F(ModelRepositoryTest, NamesStay) {
  Open();
  disk_.Put("two", "1");
  const auto failed = Reload();
  EXPECT_EQ(failed.status().code(), absl::StatusCode::kFailedPrecondition);
  EXPECT_THAT(std::string(failed.status().message()),
              HasSubstr("skeletal 'two' would be served in place of skeletal 'one'"));
  EXPECT_EQ(Version(), "1");
  EXPECT_EQ(disk_.alive, 1) << "what was refused is let go of";
}

TEST_F(ModelRepositoryTest, AFormerPipelineLivesUntilItsLastUserHasGone) {
  Open();
  auto running = repository_->current();
  disk_.Put("one", "2");
  ASSERT_TRUE(Reload().value());
  EXPECT_EQ(disk_.alive, 2);
  EXPECT_EQ(running->models().front().version, "1");
  running.reset();
  EXPECT_EQ(disk_.alive, 1);
}

// The second and the third come while the first is being loaded: they are one reload, after it.
TEST_F(ModelRepositoryTest, ThoseThatComeMeanwhileAreOneMore) {
  std::counting_semaphore<> begun(0), go_on(0);
  Open([&] {
    begun.release();
    go_on.acquire();
  });
  const int before = disk_.loads;
  auto first = Begin();
  begun.acquire();
  auto second = Begin(), third = Begin();
  go_on.release();
  EXPECT_FALSE(first.get().value());
  begun.acquire();
  disk_.Put("one", "2");
  go_on.release();
  EXPECT_TRUE(second.get().value());
  EXPECT_TRUE(third.get().value());
  EXPECT_EQ(disk_.loads, before + 2);
}

TEST_F(ModelRepositoryTest, OnceClosedEveryReloadIsRefused) {
  std::counting_semaphore<> begun(0), go_on(0);
  Open([&] {
    begun.release();
    go_on.acquire();
  });
  auto running = Begin();
  begun.acquire();
  auto waiting = Begin();
  std::thread closer([&] { repository_->Close(); });
  // Whether it comes before Close or after: it is answered.
  auto late = Begin();
  go_on.release(3);
  closer.join();
  EXPECT_TRUE(running.get().ok()) << "what runs is finished";
  for (auto* future : {&waiting, &late}) {
    const auto answer = future->get();
    EXPECT_TRUE(answer.ok() || ReasonOf(answer.status()) == "SHUTTING_DOWN") << answer.status();
  }
  EXPECT_EQ(ReasonOf(Reload().status()), "SHUTTING_DOWN");
}

}  // namespace
}  // namespace stance

#include "server/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stance {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

TEST(MetricsTest, CountsByLabel) {
  Metrics metrics;
  metrics.ObserveRequest(Rpc::kTransfer, absl::StatusCode::kOk, 0.2);
  metrics.ObserveRequest(Rpc::kTransfer, absl::StatusCode::kOk, 0.3);
  metrics.ObserveRequest(Rpc::kRig, absl::StatusCode::kUnavailable, 0.001);
  metrics.ObservePhase(Phase::kNetwork, 0.5);
  metrics.ObserveBatch(3, 20'000);
  metrics.CountRejection("QUEUE_FULL");
  metrics.CountRejection("QUEUE_FULL");
  metrics.CountLateStart();
  metrics.CountAbandoned();
  const std::string page = metrics.Page();
  EXPECT_THAT(page, HasSubstr("stance_requests_total{code=\"OK\",rpc=\"Transfer\"} 2"));
  EXPECT_THAT(page, HasSubstr("stance_requests_total{code=\"UNAVAILABLE\",rpc=\"Rig\"} 1"));
  EXPECT_THAT(page, HasSubstr("stance_request_seconds_count{rpc=\"Transfer\"} 2"));
  EXPECT_THAT(page, HasSubstr("stance_request_seconds_sum{rpc=\"Transfer\"} 0.5"));
  EXPECT_THAT(page, HasSubstr("stance_phase_seconds_bucket{phase=\"network\",le=\"0.5\"} 1"));
  EXPECT_THAT(page, HasSubstr("stance_phase_seconds_bucket{phase=\"network\",le=\"0.25\"} 0"));
  EXPECT_THAT(page, HasSubstr("stance_batch_requests_sum 3"));
  EXPECT_THAT(page, HasSubstr("stance_batch_vertices_sum 20000"));
  EXPECT_THAT(page, HasSubstr("stance_rejections_total{reason=\"QUEUE_FULL\"} 2"));
  EXPECT_THAT(page, HasSubstr("stance_late_starts_total 1"));
  EXPECT_THAT(page, HasSubstr("stance_abandoned_requests_total 1"));
}

TEST(MetricsTest, TellsModelsProcessAndReloads) {
  Metrics metrics;
  EXPECT_THAT(metrics.Page(), Not(HasSubstr("stance_token_reload_success")));
  EXPECT_THAT(metrics.Page(), Not(HasSubstr("stance_tls_certificate_expiry_seconds")));
  metrics.SetModels({{"pose", "1.1", "stance"}, {"other", "7", "skeletal"}});
  metrics.SetModels({{"pose", "1.2", "stance"}});
  metrics.CountTokenReload(true);
  metrics.CountTokenReload(false);
  metrics.SetCertificateFile("/nonexistent");
  const std::string page = metrics.Page();
  EXPECT_THAT(page, HasSubstr("stance_model_info{method=\"stance\",name=\"pose\",version=\"1.2\"} 1"));
  EXPECT_THAT(page, Not(HasSubstr("version=\"1.1\"")));
  EXPECT_THAT(page, Not(HasSubstr("name=\"other\"")));
  EXPECT_THAT(page, HasSubstr("stance_token_reloads_total{result=\"accepted\"} 1"));
  EXPECT_THAT(page, HasSubstr("stance_token_reloads_total{result=\"refused\"} 1"));
  EXPECT_THAT(page, HasSubstr("stance_token_reload_success 0"));
  EXPECT_THAT(page, HasSubstr("stance_tls_certificate_expiry_seconds 0"));
  EXPECT_THAT(page, HasSubstr("process_resident_memory_bytes "));
}

TEST(MetricsTest, CountsModelReloadsByResult) {
  Metrics metrics;
  EXPECT_THAT(metrics.Page(), HasSubstr("stance_model_reload_success 1"));
  metrics.CountModelReload(ModelReload::kSwitched);
  metrics.CountModelReload(ModelReload::kUnchanged);
  metrics.CountModelReload(ModelReload::kFailed);
  const std::string page = metrics.Page();
  for (const char* result : {"switched", "unchanged", "failed"}) {
    EXPECT_THAT(page, HasSubstr("stance_model_reloads_total{result=\"" + std::string(result) + "\"} 1"));
  }
  EXPECT_THAT(page, HasSubstr("stance_model_reload_success 0"));
  metrics.CountModelReload(ModelReload::kUnchanged);
  EXPECT_THAT(metrics.Page(), HasSubstr("stance_model_reload_success 1"));
}

TEST(MetricsTest, ReadsTheRigCacheAtEachScrape) {
  Metrics metrics;
  EXPECT_THAT(metrics.Page(), HasSubstr("stance_rig_cache_hits_total 0"));
  RigCache::Stats stats{.hits = 3, .misses = 5, .evictions = 2, .entries = 4, .bytes = 700};
  metrics.SetRigCacheSource([&stats] { return stats; });
  metrics.Page();
  stats.hits = 8;
  const std::string page = metrics.Page();
  EXPECT_THAT(page, HasSubstr("stance_rig_cache_hits_total 8"));
  EXPECT_THAT(page, HasSubstr("stance_rig_cache_misses_total 5"));
  EXPECT_THAT(page, HasSubstr("stance_rig_cache_evictions_total 2"));
  EXPECT_THAT(page, HasSubstr("stance_rig_cache_entries 4"));
  EXPECT_THAT(page, HasSubstr("stance_rig_cache_bytes 700"));
}

TEST(MetricsTest, ReadsTheQueueAtEachScrape) {
  Metrics metrics;
  int64_t waiting = 4;
  metrics.SetQueueSource([&waiting] {
    return QueueGauges{.queued_requests = waiting,
                       .queued_bytes = 500,
                       .queued_vertices = 7000,
                       .queued_clients = 3,
                       .running_requests = 2};
  });
  EXPECT_THAT(metrics.Page(), HasSubstr("stance_queued_requests 4"));
  waiting = 0;
  const std::string page = metrics.Page();
  EXPECT_THAT(page, HasSubstr("stance_queued_requests 0"));
  EXPECT_THAT(page, HasSubstr("stance_queued_bytes 500"));
  EXPECT_THAT(page, HasSubstr("stance_queued_vertices 7000"));
  EXPECT_THAT(page, HasSubstr("stance_queued_clients 3"));
  EXPECT_THAT(page, HasSubstr("stance_running_requests 2"));
  metrics.SetQueueSource(nullptr);
  EXPECT_THAT(metrics.Page(), HasSubstr("stance_queued_bytes 0"));
}

}  // namespace
}  // namespace stance

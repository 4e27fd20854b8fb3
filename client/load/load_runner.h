// Runs a LoadPlan against a real server.
#pragma once

#include <chrono>

#include "client/channel.h"
#include "client/load/load_plan.h"
#include "client/load/load_report.h"
#include "core/base/status.h"
#include "stance/v1/pose_transfer.pb.h"

namespace stance {

struct LoadOptions {
  LoadPlanOptions plan;
  // Each request's deadline, from the moment it is sent.
  std::chrono::duration<double> timeout{30.0};
  // Requests sent one after the other before the measurement, not counted.
  int warmup = 0;
};

// Sends copies of `request` as planned and waits for every answer. An error only where nothing could be
// measured: no connection, or a warm-up request failed.
absl::StatusOr<LoadReport> RunLoad(const ClientOptions& client, const v1::TransferRequest& request,
                                   const LoadOptions& options);

}  // namespace stance

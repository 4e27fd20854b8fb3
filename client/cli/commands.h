// The commands of `stance`. Each returns OK, or a status that ExitCodeFor and ErrorLine turn into the exit
// status and the line on stderr.
#pragma once

#include "client/cli/arguments.h"
#include "core/base/status.h"

namespace stance {

absl::Status RunTransfer(const TransferArguments& arguments);
absl::Status RunAnimate(const AnimateArguments& arguments);
absl::Status RunRig(const RigArguments& arguments);
absl::Status RunInfo(const InfoArguments& arguments);
absl::Status RunRender(const RenderArguments& arguments);
absl::Status RunServerInfo(const ServerInfoArguments& arguments);
absl::Status RunReload(const ReloadArguments& arguments);

}  // namespace stance

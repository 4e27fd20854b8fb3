// The contract's answers into core's values.
#pragma once

#include "client/answers.h"
#include "core/base/status.h"
#include "core/mesh/triangle_mesh.h"
#include "stance/v1/admin.pb.h"
#include "stance/v1/pose_transfer.pb.h"
#include "stance/v1/server_info.pb.h"

namespace stance {

// INTERNAL, naming the field, for an answer that is damaged or does not fit the source.
absl::StatusOr<TransferAnswer> ReadTransferResponse(const v1::TransferResponse& response,
                                                    const TriangleMesh& source);
absl::StatusOr<RigAnswer> ReadRigResponse(const v1::RigResponse& response, const TriangleMesh& mesh);
ServerInfo ReadServerInfo(const v1::GetServerInfoResponse& response);
ReloadAnswer ReadReloadResponse(const v1::ReloadModelsResponse& response);

}  // namespace stance

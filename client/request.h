// Core's values into the contract's requests.
#pragma once

#include <string>

#include "client/client.h"
#include "core/mesh/triangle_mesh.h"
#include "core/transfer/pipeline.h"
#include "stance/v1/pose_transfer.pb.h"

namespace stance {

// Positions and indices of both meshes as arrays, and the source's normals, so that the target has normals
// where the source had.
v1::TransferRequest MakeTransferRequest(const TriangleMesh& source, const TriangleMesh& reference,
                                        const TransferOptions& options, const CallOptions& call);

// The same in messages of a stream; the answers hold no weights.
v1::AnimateRequest MakeAnimateStart(const TriangleMesh& source, const TransferOptions& options,
                                    const CallOptions& call);
v1::AnimateRequest MakeAnimateReference(const TriangleMesh& reference, const TransferOptions& options);

v1::RigRequest MakeRigRequest(const TriangleMesh& mesh, const TransferOptions& options,
                              const CallOptions& call);

}  // namespace stance

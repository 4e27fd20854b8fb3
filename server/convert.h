// Requests to core's options and meshes, and core's results to answers.
#pragma once

#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/mesh/triangle_mesh.h"
#include "core/skeleton/bone_names.h"
#include "core/transfer/pipeline.h"
#include "server/batching/fair_queue.h"
#include "stance/v1/pose_transfer.pb.h"
#include "stance/v1/server_info.pb.h"

namespace stance {

// What a request may ask for on this server.
struct Catalog {
  std::vector<ModelInfo> models;  // the first is the default
  Skeleton skeleton;
  MeshLimits limits;
};

// A Transfer request, understood.
struct TransferPlan {
  TransferOptions options;
  std::string model;
  bool want_target = false;
  bool want_skeletons = false;
  bool want_weights = false;
  bool want_transforms = false;  // the reference's weights: options.reference_weights
  v1::OutputFormat target_format = v1::OUTPUT_FORMAT_ARRAYS;  // never unspecified
  BoneNaming bone_naming = BoneNaming::kSmpl;
  Priority priority = Priority::kNormal;
};

// A Rig request, understood.
struct RigPlan {
  TransferOptions options;
  std::string model;
  BoneNaming bone_naming = BoneNaming::kSmpl;
  Priority priority = Priority::kNormal;
};

// Everything about a request but its meshes' content, in constant time. Errors are FieldErrors
// (status_map.h): INVALID_ARGUMENT, NOT_FOUND for an unknown model, FAILED_PRECONDITION for a method without
// a model.
absl::StatusOr<TransferPlan> PlanTransfer(const v1::TransferRequest& request, const Catalog& catalog);
absl::StatusOr<RigPlan> PlanRig(const v1::RigRequest& request, const Catalog& catalog);
// What the references of a stream have in common: everything but options.reference_up, which
// PlanReference finds.
absl::StatusOr<TransferPlan> PlanAnimate(const v1::AnimateStart& start, const Catalog& catalog);
absl::StatusOr<UpAxis> PlanReference(const v1::AnimateReference& reference);

// The vertices of a mesh that has not been read yet: exact for arrays, a guess from its bytes for a file.
int64_t EstimateVertices(const v1::Mesh& mesh);

// The mesh in the request's field `field` ("source"). Errors are FieldErrors.
absl::StatusOr<TriangleMesh> DecodeMesh(const v1::Mesh& mesh, const std::string& field,
                                        const MeshLimits& limits = {});

// Fills what the plan asks for; warnings, model and the core's phases always. `source_up`: as the request has
// it.
absl::Status EncodeTransfer(const TransferPlan& plan, const TransferResult& result, const Catalog& catalog,
                            v1::UpAxis source_up, v1::TransferResponse* response);
void EncodeRig(const RigPlan& plan, const RigResult& result, const Catalog& catalog,
               v1::RigResponse* response);

v1::Method MethodToWire(Method method);
void ModelToWire(const ModelInfo& model, v1::Model* wire);

}  // namespace stance

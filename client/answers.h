// What a transfer or a rig answers, whether it ran on a server or in this process.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/mesh/triangle_mesh.h"
#include "core/skeleton/bone_names.h"
#include "core/transfer/pipeline.h"

namespace stance {

// J names, SMPL's for a human skeleton, and parents; parents[0] is -1 and every parent precedes its children.
struct JointTree {
  std::vector<std::string> names;
  std::vector<int> parents;
};

// Gives the joints of the human skeleton their names in `naming`. Leaves another skeleton alone.
void NameBones(BoneNaming naming, JointTree* joints);

// Seconds that only a server spends.
struct ServiceSeconds {
  double queue = 0;
  double decode = 0;
  double encode = 0;
};

struct TransferAnswer {
  JointTree joints;
  TransferResult result;  // weights have no rows where they were not asked for
  ServiceSeconds service;
  std::string request_id;  // empty in this process
};

// The references of an animation, one at each call; nothing at the end. May be called on another thread.
using NextReference = std::function<std::optional<TriangleMesh>()>;
// Takes the answers of an animation, in the order of their references.
using TakeAnswer = std::function<void(absl::StatusOr<TransferAnswer>)>;

struct RigAnswer {
  JointTree joints;
  RigResult result;
  ServiceSeconds service;
  std::string request_id;
};

// A model as a server describes it; the method in the words of its own version.
struct ServedModel {
  std::string name;
  std::string version;
  std::string method;  // "stance"
  int joint_count = 0;
  int64_t parameter_count = 0;
  int64_t sample_count = 0;
};

struct ServerInfo {
  std::string version;
  std::vector<ServedModel> models;  // the first is the default
  std::string default_method;       // of a request that names neither method nor model
  std::vector<std::string> methods;
  std::vector<std::string> formats;
  int64_t max_message_bytes = 0;
  int64_t max_vertices = 0;  // of one mesh
  int64_t max_faces = 0;
  int64_t max_queued_requests = 0;
  int64_t max_queued_bytes = 0;
  int64_t max_queued_vertices = 0;
  int64_t max_queued_requests_per_client = 0;  // 0: no such bound
  int64_t max_batch_requests = 0;
  int64_t max_batch_vertices = 0;
  int64_t max_stream_references = 0;  // of an animation, read and not yet answered
};

struct ReloadAnswer {
  bool switched = false;            // false: the models on disk are those that were served already
  std::vector<ServedModel> models;  // that are served now; the first is the default
};

}  // namespace stance

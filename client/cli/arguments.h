// The command line of `stance`, checked as far as it can be without opening a file.
#pragma once

#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "client/cli/credentials.h"
#include "core/base/status.h"
#include "core/skeleton/bone_names.h"
#include "core/transfer/pipeline.h"

namespace stance {

// Where the work is done.
struct BackendArguments {
  std::string server;               // HOST:PORT; empty if local
  bool local = false;               // core in this process
  CredentialArguments credentials;  // server only
  // Local: folders of models, or of folders of models; server: at most one, its name. None: the default.
  std::vector<std::string> models;
  double timeout = 120.0;  // seconds, server only
  int threads = 0;         // local only; 0: the CPU quota
};

struct TransferArguments {
  std::string source, reference;
  std::vector<std::string> outputs;  // at least one, all different
  BackendArguments backend;
  TransferOptions options;
  std::string skeleton;  // optional files
  std::string weights;
  std::string view;
  BoneNaming bone_naming = BoneNaming::kSmpl;
  double min_confidence = 0;  // in [0, 1]; 0: whatever it is, and known or not
  bool quiet = false;
  bool json = false;
};

struct AnimateArguments {
  std::string source;
  std::vector<std::string> references;  // meshes, or folders of meshes; at least one
  std::string output;                   // the folder for the targets
  std::string format;                   // "glb"
  BackendArguments backend;
  TransferOptions options;
  bool quiet = false;
};

struct RigArguments {
  std::string mesh;
  std::vector<std::string> outputs;
  BackendArguments backend;
  TransferOptions options;  // those that RigJob reads
  std::string weights;
  BoneNaming bone_naming = BoneNaming::kSmpl;
  bool quiet = false;
  bool json = false;
};

struct InfoArguments {
  std::string mesh;
  bool json = false;
};

struct RenderArguments {
  std::vector<std::string> meshes;
  std::string output;
  std::vector<std::string> captions;  // none, or one per mesh
  UpAxis up = UpAxis::kY;
  std::optional<double> yaw, pitch;  // degrees
  int columns = 0;
};

struct ServerInfoArguments {
  BackendArguments backend;
  bool json = false;
};

// Of an admin.listen: there is no default that would fit.
struct ReloadArguments {
  BackendArguments backend;
  bool json = false;
};

// What `--help` or `--version` asked for.
struct TextToPrint {
  std::string text;
};

using Command = std::variant<TransferArguments, AnimateArguments, RigArguments, InfoArguments,
                             RenderArguments, ServerInfoArguments, ReloadArguments, TextToPrint>;

// INVALID_ARGUMENT, in one line that names the option, for anything that docs/cli.md does not allow.
absl::StatusOr<Command> ParseArguments(int argc, const char* const* argv);

// The default of --server: $STANCE_SERVER, or localhost:50051.
std::string DefaultServer();

}  // namespace stance

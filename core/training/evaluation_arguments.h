// stance-eval's command line.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "core/training/character_generator.h"
#include "core/training/evaluation_curves.h"
#include "core/transfer/pipeline.h"

namespace stance {

enum class EvaluationCommand { kPairs, kStages, kCurves, kFiles, kRender, kBones, kConfidence, kAblations };

struct EvaluationArguments {
  EvaluationCommand command = EvaluationCommand::kPairs;
  std::string command_line;  // as typed, the program's name without its folder
  std::filesystem::path model;
  std::filesystem::path data;                // a pack; or else
  std::filesystem::path mpfb, bvh;           // the folders that one is made from
  std::filesystem::path out;                 // folder; empty: print only
  std::filesystem::path list;                // kFiles
  std::vector<std::filesystem::path> files;  // kRender: source, reference, ...; empty: test pairs
  std::vector<int> indices;                  // kRender: only these pairs; empty: every `every`-th
  std::vector<PoseMix> poses;
  std::vector<Curve> curves;  // kCurves
  int pairs = 100;
  int every = 1;
  int identities = 10;
  int poses_each = 20;
  int threads = 1;
  uint64_t seed = 1;
  double yaw_degrees = 20;
  bool full_resolution = false;
  bool no_parts = false;
  bool skeletons = false;
  bool weights = false;
  CharacterOptions characters{.split = Split::kTest};
  TransferOptions transfer;
};

// Fills `arguments`; the code to exit with if that is the end of it: 0 after --help, 2, with a message on
// standard error, for a command line that means nothing.
std::optional<int> ParseEvaluationArguments(int argc, const char* const* argv,
                                            EvaluationArguments& arguments);

}  // namespace stance

// What a successful transfer or rig prints on stdout.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "client/answers.h"
#include "core/transfer/pipeline.h"

namespace stance {

struct Summary {
  int64_t vertices = 0;
  int64_t faces = 0;
  std::vector<std::string> outputs;
  std::vector<std::string> warnings;
  std::string model;
  std::optional<float> confidence;  // of a transfer, where its method knows it
  std::string request_id;           // empty without a server
  PhaseSeconds phases;
  ServiceSeconds service;
  double wall_seconds = 0;  // the whole command, files included
};

// One JSON object, or a line of text per fact.
std::string SummaryText(const Summary& summary, bool json);

void PrintSummary(const Summary& summary, bool json);

}  // namespace stance

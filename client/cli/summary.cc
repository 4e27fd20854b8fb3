#include "client/cli/summary.h"

#include <fmt/format.h>

#include <cstdio>
#include <nlohmann/json.hpp>

namespace stance {

std::string SummaryText(const Summary& summary, bool json) {
  if (json) {
    const PhaseSeconds& phases = summary.phases;
    nlohmann::ordered_json object = {{"vertices", summary.vertices},
                                     {"faces", summary.faces},
                                     {"outputs", summary.outputs},
                                     {"warnings", summary.warnings},
                                     {"model", summary.model}};
    if (summary.confidence) object["confidence"] = *summary.confidence;
    if (!summary.request_id.empty()) object["request_id"] = summary.request_id;
    object["seconds"] = {{"queue", summary.service.queue},
                         {"decode", summary.service.decode},
                         {"check", phases.check},
                         {"resample", phases.resample},
                         {"network", phases.network},
                         {"pose", phases.pose},
                         {"weights", phases.weights},
                         {"deform", phases.deform},
                         {"encode", summary.service.encode},
                         {"total", phases.total},
                         {"wall", summary.wall_seconds}};
    return object.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
  }
  std::string text;
  for (const std::string& warning : summary.warnings) text += fmt::format("warning: {}\n", warning);
  text += fmt::format("{} vertices, {} faces, model {}: {:.0f} ms, {:.0f} ms with files\n", summary.vertices,
                      summary.faces, summary.model, 1e3 * summary.phases.total, 1e3 * summary.wall_seconds);
  if (summary.confidence) text += fmt::format("confidence {:.2f}\n", *summary.confidence);
  for (const std::string& output : summary.outputs) text += fmt::format("wrote {}\n", output);
  return text;
}

void PrintSummary(const Summary& summary, bool json) {
  std::fputs(SummaryText(summary, json).c_str(), stdout);
}

}  // namespace stance

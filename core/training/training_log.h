// The trainer's CSV log and its loss plot.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "core/base/status.h"

namespace stance {

struct LogRow {
  double seen = 0;         // characters
  double seconds = 0;      // of training
  double loss = 0;         // the stage's own loss, mean since the last row
  double accuracy = 0;     // f_C: fraction of points with the right joint; 0 in stage "joints"
  double joint_mm = 0;     // f_J: mean joint error for a 1.7 m character; 0 in stage "weights"
  double degrees = 0;      // mean rotation error; 0 in paper A's stages
  double transfer_mm = 0;  // stage "pose": mean error of a transfer to the next character of the batch
  double learning_rate = 0;
};

// Appends one row; writes the header into a new file.
absl::Status AppendLog(const std::filesystem::path& csv, const LogRow& row);
absl::StatusOr<std::vector<LogRow>> ReadLog(const std::filesystem::path& csv);

// The loss over characters seen, both axes logarithmic, as an SVG file.
absl::Status WriteLossPlot(const std::vector<LogRow>& rows, const std::string& title,
                           const std::filesystem::path& svg);

}  // namespace stance

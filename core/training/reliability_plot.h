// Reliability bins as a picture.
#pragma once

#include <span>
#include <string>

#include "core/training/reliability.h"

namespace stance {

// An SVG file's text: per bin a bar as high as the fraction that was so, before calibration and beside it
// after, a dot at each bar's mean probability, and the diagonal on which a calibrated model's bars end.
// REQUIRES: bins of equal number.
std::string ReliabilityPlot(std::span<const ReliabilityBin> before, std::span<const ReliabilityBin> after);

}  // namespace stance

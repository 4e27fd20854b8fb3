// What observations of a method's confidence say, as text for files.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "core/training/evaluation_confidence.h"
#include "core/training/reliability.h"

namespace stance {

// The calibration that does what `first` and then `second` do.
ConfidenceCalibration ComposedCalibration(const ConfidenceCalibration& first,
                                          const ConfidenceCalibration& second);

// The member to put into a model's manifest.json: "confidence": {"scale": 0.9, "bias": 0.1}.
std::string CalibrationJson(const ConfidenceCalibration& calibration);

struct ConfidenceReport {
  std::vector<ConfidenceObservation> observations;
  // What the confidences had been through when they were observed (ModelInfo::confidence).
  ConfidenceCalibration present;
  // Fitted to the joints' claims of the pairs with even index, to act on the observed confidences; nothing
  // where FitCalibration found none. The pairs with odd index are held out to check it.
  std::optional<ConfidenceCalibration> fitted;
};

ConfidenceReport AnalyseConfidence(std::vector<ConfidenceObservation> observations,
                                   const ConfidenceCalibration& present);

// Tables of: how good joints' and transfers' claims are, before and after calibration; reliability in bins;
// each joint; what thresholds keep; the manifest's new member; failures.
std::string ConfidenceMarkdown(const ConfidenceReport& report);

// The same after a header, and each pose mix's own where the markdown has only all of them together, as lines
// "table,poses,row,quantity,value" with six digits.
std::string ConfidenceCsv(const ConfidenceReport& report);

// The reliability of held-out joints' claims before and after calibration, an SVG file's text.
std::string ConfidencePlot(const ConfidenceReport& report);

}  // namespace stance

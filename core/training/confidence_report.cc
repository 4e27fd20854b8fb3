#include "core/training/confidence_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

#include "core/mesh/metrics.h"
#include "core/network/pose_model.h"
#include "core/training/reliability_plot.h"

namespace stance {
namespace {

using Observations = std::vector<ConfidenceObservation>;

const std::vector<double>& Thresholds() {
  // Closest where networks' confidences lie closest.
  static const std::vector<double> kThresholds = {0,     0.3,  0.5,   0.6, 0.7,   0.75, 0.775, 0.8,
                                                  0.825, 0.85, 0.875, 0.9, 0.925, 0.95, 0.975};
  return kThresholds;
}

template <class Predicate>
Observations Where(const Observations& all, Predicate predicate) {
  Observations some;
  std::copy_if(all.begin(), all.end(), std::back_inserter(some), predicate);
  return some;
}

Observations HeldOut(const Observations& all) {
  return Where(all, [](const ConfidenceObservation& one) { return one.index % 2 == 1; });
}

// The observations of each pose mix in the order of first appearance, and of all of them if there are more.
std::vector<std::pair<std::string, Observations>> ByPoses(const Observations& all) {
  std::vector<std::pair<std::string, Observations>> groups;
  for (const ConfidenceObservation& one : all) {
    const auto named = [&](const auto& group) { return group.first == one.poses; };
    auto group = std::find_if(groups.begin(), groups.end(), named);
    if (group == groups.end()) group = groups.insert(groups.end(), {one.poses, {}});
    group->second.push_back(one);
  }
  if (groups.size() > 1) groups.emplace_back("all", all);
  return groups;
}

// How good claims are, in numbers.
struct Quality {
  size_t count = 0;
  double stated = 0, right = 0, ece = 0, brier = 0;
};

Quality QualityOf(const std::vector<Claim>& claims) {
  Quality quality{.count = claims.size()};
  for (const Claim& claim : claims) {
    quality.stated += claim.probability / static_cast<double>(claims.size());
    quality.right += claim.outcome / static_cast<double>(claims.size());
  }
  quality.ece = ExpectedCalibrationError(Reliability(claims));
  quality.brier = BrierScore(claims);
  return quality;
}

// Claims about joints or about transfers: all, those held out, and these behind the calibration, if any.
struct ClaimSets {
  std::string name;
  std::vector<Claim> all, held_out;
  std::optional<std::vector<Claim>> calibrated;
};

std::vector<ClaimSets> SetsOf(const Observations& observations,
                              const std::optional<ConfidenceCalibration>& fitted) {
  const Observations held_out = HeldOut(observations);
  ClaimSets joints{"joints", JointClaims(observations), JointClaims(held_out), {}};
  ClaimSets transfers{"transfers", TransferClaims(observations), TransferClaims(held_out), {}};
  if (fitted) {
    joints.calibrated = Calibrated(joints.held_out, *fitted);
    transfers.calibrated = TransferClaims(held_out, *fitted);
  }
  return {joints, transfers};
}

std::string QualityTable(const ConfidenceReport& report) {
  std::string table =
      "| claims of | poses | count | mean stated | true | ECE | Brier | held out | ECE | ECE calibrated | "
      "Brier "
      "| Brier calibrated |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const auto& [poses, observations] : ByPoses(report.observations)) {
    for (const ClaimSets& sets : SetsOf(observations, report.fitted)) {
      const Quality all = QualityOf(sets.all), held_out = QualityOf(sets.held_out);
      const auto calibrated = [&](double Quality::*field) {
        return sets.calibrated ? fmt::format("{:.4f}", QualityOf(*sets.calibrated).*field) : "";
      };
      table += fmt::format(
          "| {} | {} | {} | {:.3f} | {:.3f} | {:.4f} | {:.4f} | {} | {:.4f} | {} | {:.4f} | {} |\n",
          sets.name, poses, all.count, all.stated, all.right, all.ece, all.brier, held_out.count,
          held_out.ece, calibrated(&Quality::ece), held_out.brier, calibrated(&Quality::brier));
    }
  }
  return table;
}

std::string BinsTable(const std::vector<Claim>& claims) {
  std::string table = "| stated | count | mean stated | true |\n|---|---|---|---|\n";
  for (const ReliabilityBin& bin : Reliability(claims)) {
    table += bin.count > 0 ? fmt::format("| {:.1f} to {:.1f} | {} | {:.3f} | {:.3f} |\n", bin.low, bin.high,
                                         bin.count, bin.mean_probability, bin.mean_outcome)
                           : fmt::format("| {:.1f} to {:.1f} | 0 | | |\n", bin.low, bin.high);
  }
  return table;
}

std::string JointTable(const Observations& observations) {
  std::string table = "| joint | mean stated | right | ECE | Brier |\n|---|---|---|---|---|\n";
  for (int j = 0; j < kHumanJoints; ++j) {
    const Quality quality = QualityOf(JointClaims(observations, j));
    table += fmt::format("| {} | {:.3f} | {:.3f} | {:.3f} | {:.3f} |\n", HumanSkeleton().names()[j],
                         quality.stated, quality.right, quality.ece, quality.brier);
  }
  return table;
}

std::string ThresholdTable(const Observations& observations, const ConfidenceCalibration& calibration) {
  std::string table = "| least confidence | kept | mean mm | p95 mm | worst mm |\n|---|---|---|---|---|\n";
  for (const KeptTransfers& kept : KeptAbove(observations, Thresholds(), calibration)) {
    table += kept.share > 0 ? fmt::format("| {:.3f} | {:.1f} % | {:.1f} | {:.1f} | {:.1f} |\n", kept.least,
                                          kept.share * 100, kept.mean_mm, kept.p95_mm, kept.worst_mm)
                            : fmt::format("| {:.3f} | 0 % | | | |\n", kept.least);
  }
  return table;
}

}  // namespace

ConfidenceCalibration ComposedCalibration(const ConfidenceCalibration& first,
                                          const ConfidenceCalibration& second) {
  return {.scale = second.scale * first.scale, .bias = second.scale * first.bias + second.bias};
}

std::string CalibrationJson(const ConfidenceCalibration& calibration) {
  return fmt::format("\"confidence\": {{\"scale\": {:.6g}, \"bias\": {:.6g}}}", calibration.scale,
                     calibration.bias);
}

ConfidenceReport AnalyseConfidence(Observations observations, const ConfidenceCalibration& present) {
  const Observations even =
      Where(observations, [](const ConfidenceObservation& one) { return one.index % 2 == 0; });
  return {std::move(observations), present, FitCalibration(JointClaims(even))};
}

std::string ConfidenceMarkdown(const ConfidenceReport& report) {
  const Observations& all = report.observations;
  std::string text = fmt::format(
      "A joint is right within {} degrees and {} mm of a {} m character. A transfer's claim is the share of "
      "the source's surface that follows joints right in both characters. The calibration is fitted to the "
      "joints of the pairs with even index; those with odd index are held out.\n\n{}",
      kRightDegrees, kRightMillimetres, kReferenceStature, QualityTable(report));
  if (report.fitted) {
    text += fmt::format("\nFor the model's manifest.json:\n\n    {}\n",
                        CalibrationJson(ComposedCalibration(report.present, *report.fitted)));
  } else {
    text += "\nNo calibration with a scale above 0 fits these claims.\n";
  }
  text += fmt::format("\n## Joints' claims\n\n{}\n## Transfers' claims\n\n{}", BinsTable(JointClaims(all)),
                      BinsTable(TransferClaims(all)));
  text += fmt::format("\n## What a least confidence keeps\n\n{}", ThresholdTable(all, {}));
  if (report.fitted) {
    text += fmt::format("\nBehind the new calibration:\n\n{}", ThresholdTable(all, *report.fitted));
  }
  text += fmt::format("\n## Each joint's claims\n\n{}", JointTable(all));
  const Observations failed =
      Where(all, [](const ConfidenceObservation& one) { return !one.failure.empty(); });
  if (!failed.empty()) text += fmt::format("\n{} failed:\n\n", failed.size());
  for (const ConfidenceObservation& one : failed) {
    text += fmt::format("- {}-{}: {}\n", one.poses, one.index, one.failure);
  }
  return text;
}

std::string ConfidenceCsv(const ConfidenceReport& report) {
  std::string csv = "table,poses,row,quantity,value\n";
  const auto add = [&csv](const std::string& row, const char* quantity, double value) {
    csv += fmt::format("{},{},{:.6g}\n", row, quantity, value);
  };
  const auto add_quality = [&](const std::string& row, const std::vector<Claim>& claims) {
    const Quality quality = QualityOf(claims);
    add(row, "count", static_cast<double>(quality.count));
    add(row, "stated", quality.stated);
    add(row, "true", quality.right);
    add(row, "ece", quality.ece);
    add(row, "brier", quality.brier);
  };
  const auto add_bins = [&](const std::string& table, const std::vector<Claim>& claims) {
    for (const ReliabilityBin& bin : Reliability(claims)) {
      const std::string row = fmt::format("{},{:.1f}", table, bin.low);
      add(row, "count", static_cast<double>(bin.count));
      add(row, "stated", bin.mean_probability);
      add(row, "true", bin.mean_outcome);
    }
  };
  const auto add_kept = [&](const std::string& table, const Observations& observations,
                            const ConfidenceCalibration& calibration) {
    for (const KeptTransfers& kept : KeptAbove(observations, Thresholds(), calibration)) {
      const std::string row = fmt::format("{},{:.3f}", table, kept.least);
      add(row, "kept", kept.share);
      add(row, "mean_mm", kept.mean_mm);
      add(row, "p95_mm", kept.p95_mm);
      add(row, "worst_mm", kept.worst_mm);
    }
  };
  for (const auto& [poses, observations] : ByPoses(report.observations)) {
    for (const ClaimSets& sets : SetsOf(observations, report.fitted)) {
      add_quality(fmt::format("{},{},all", sets.name, poses), sets.all);
      add_quality(fmt::format("{},{},held_out", sets.name, poses), sets.held_out);
      add_bins(fmt::format("{}_bins,{}", sets.name, poses), sets.all);
      add_bins(fmt::format("{}_bins_held_out,{}", sets.name, poses), sets.held_out);
      if (!sets.calibrated) continue;
      add_quality(fmt::format("{},{},held_out_calibrated", sets.name, poses), *sets.calibrated);
      add_bins(fmt::format("{}_bins_held_out_calibrated,{}", sets.name, poses), *sets.calibrated);
    }
    for (int j = 0; j < kHumanJoints; ++j) {
      add_quality(fmt::format("joint,{},{}", poses, HumanSkeleton().names()[j]),
                  JointClaims(observations, j));
    }
    add_kept(fmt::format("kept,{}", poses), observations, {});
    if (report.fitted) add_kept(fmt::format("kept_calibrated,{}", poses), observations, *report.fitted);
  }
  if (report.fitted) {
    const ConfidenceCalibration manifest = ComposedCalibration(report.present, *report.fitted);
    add("calibration,,manifest", "scale", manifest.scale);
    add("calibration,,manifest", "bias", manifest.bias);
  }
  return csv;
}

std::string ConfidencePlot(const ConfidenceReport& report) {
  const std::vector<Claim> held_out = JointClaims(HeldOut(report.observations));
  return ReliabilityPlot(Reliability(held_out),
                         Reliability(Calibrated(held_out, report.fitted.value_or(ConfidenceCalibration()))));
}

}  // namespace stance

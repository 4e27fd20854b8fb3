#include "core/training/evaluation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/base/check.h"

namespace stance {
namespace {

// The mean of `value` over rows.
template <class Value>
double Mean(const std::vector<const EvaluationRow*>& rows, Value value) {
  double sum = 0;
  for (const EvaluationRow* row : rows) sum += value(*row);
  return rows.empty() ? 0 : sum / static_cast<double>(rows.size());
}

std::string SummaryLine(const std::string& method, const std::vector<EvaluationRow>& rows) {
  std::vector<const EvaluationRow*> done;
  std::vector<double> pmd;
  double worst = 0;
  int failures = 0;
  for (const EvaluationRow& row : rows) {
    if (row.method != method) continue;
    if (!row.failure.empty()) {
      ++failures;
      continue;
    }
    done.push_back(&row);
    pmd.push_back(row.errors.pmd);
    worst = std::max(worst, row.errors.mean_mm);
  }
  const std::string pairs =
      failures == 0 ? fmt::format("{}", done.size()) : fmt::format("{} (+{} failed)", done.size(), failures);
  if (done.empty()) return fmt::format("| {} | {} | | | | | | | | | | | | | |\n", method, pairs);
  const auto mean = [&done](auto value) { return Mean(done, value); };
  const double seconds = mean([](const EvaluationRow& row) { return row.seconds; });
  return fmt::format(
      "| {} | {} | {:.2f} | {:.2f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.3f} | {:.3f} | {:.2f} | {:.4f} | "
      "{:.1f} | {:.2f} | {} |\n",
      method, pairs, mean([](const EvaluationRow& row) { return row.errors.pmd * 1e4; }),
      Quantile(pmd, 0.5) * 1e4, mean([](const EvaluationRow& row) { return row.errors.mean_mm; }),
      mean([](const EvaluationRow& row) { return row.median_mm; }),
      mean([](const EvaluationRow& row) { return row.p95_mm; }), worst,
      mean([](const EvaluationRow& row) { return row.errors.max_dist; }),
      mean([](const EvaluationRow& row) { return row.errors.elr; }),
      mean([](const EvaluationRow& row) { return row.errors.el * 1e6; }),
      mean([](const EvaluationRow& row) { return row.errors.edge_ratio_error; }),
      mean([](const EvaluationRow& row) { return row.errors.chamfer * 1e3; }),
      mean([](const EvaluationRow& row) { return row.errors.centred_pmd * 1e4; }),
      seconds > 0 ? fmt::format("{:.2f}", seconds) : "");
}

}  // namespace

std::string CsvField(const std::string& text) {
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"') quoted += '"';
    quoted += c;
  }
  return quoted + '"';
}

double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  const double place = q * static_cast<double>(values.size() - 1);
  const auto below = static_cast<size_t>(std::floor(place));
  const size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - std::floor(place)) * (values[above] - values[below]);
}

Candidate MethodCandidate(Method method, const absl::StatusOr<TransferResult>& result) {
  if (!result.ok()) return {.method = MethodName(method), .positions = result.status()};
  return {
      .method = MethodName(method), .positions = result->target.positions, .seconds = result->seconds.total};
}

EvaluationRow Judge(const std::string& pair, const Candidate& candidate, const Points& truth,
                    const Faces& faces, double stature) {
  STANCE_CHECK(stature > 0);
  EvaluationRow row{.pair = pair, .method = candidate.method, .seconds = candidate.seconds};
  if (!candidate.positions.ok()) {
    row.failure = std::string(candidate.positions.status().ToString());
    return row;
  }
  const auto scale = static_cast<float>(kReferenceStature / stature);
  const Points predicted = *candidate.positions * scale, scaled_truth = truth * scale;
  // A comparison with NaN is false, so that a broken result could pass for a perfect one in a maximum.
  if (!predicted.allFinite()) {
    row.failure = "the result has a coordinate that is not finite";
    return row;
  }
  row.errors = CompareMeshes(predicted, scaled_truth, faces);
  const Eigen::VectorXd distances = VertexErrorsMm(predicted, scaled_truth);
  const std::vector<double> values(distances.begin(), distances.end());
  row.median_mm = Quantile(values, 0.5);
  row.p95_mm = Quantile(values, 0.95);
  return row;
}

std::string SummaryMarkdown(const std::vector<EvaluationRow>& rows) {
  std::vector<std::string> methods;
  for (const EvaluationRow& row : rows) {
    if (std::find(methods.begin(), methods.end(), row.method) == methods.end()) methods.push_back(row.method);
  }
  std::string table =
      "| method | pairs | PMD 1e-4 m^2 | median PMD | mean mm | median mm | p95 mm | worst mm | MaxDist m | "
      "ELR | EL 1e-6 m^2 | edge ratio error | Chamfer mm | centred PMD | s |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const std::string& method : methods) table += SummaryLine(method, rows);
  return table;
}

std::string RowsCsv(const std::vector<EvaluationRow>& rows) {
  std::string csv =
      "pair,method,pmd_m2,mean_mm,median_mm,p95_mm,max_dist_m,elr,el_m2,edge_ratio_error,chamfer_m,"
      "centred_pmd_m2,seconds,failure\n";
  for (const EvaluationRow& row : rows) {
    csv += fmt::format("{},{},", CsvField(row.pair), CsvField(row.method));
    if (row.failure.empty()) {
      const MeshErrors& e = row.errors;
      csv += fmt::format("{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.6g},{:.4g},\n",
                         e.pmd, e.mean_mm, row.median_mm, row.p95_mm, e.max_dist, e.elr, e.el,
                         e.edge_ratio_error, e.chamfer, e.centred_pmd, row.seconds);
    } else {
      csv += fmt::format(",,,,,,,,,,,{}\n", CsvField(row.failure));
    }
  }
  return csv;
}

}  // namespace stance

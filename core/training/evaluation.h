// How far results are from known answers: rows of errors, their summary, and both as text for files.
#pragma once

#include <string>
#include <vector>

#include "core/base/status.h"
#include "core/mesh/metrics.h"
#include "core/mesh/triangle_mesh.h"
#include "core/transfer/pipeline.h"

namespace stance {

// One result for one transfer: what the method, or a composition of its parts, made of it.
struct Candidate {
  std::string method;  // the row's name in tables
  absl::StatusOr<Points> positions;
  double seconds = 0;  // the transfer took; 0 where that means nothing
};

// The transfer itself, in a row with the method's name.
Candidate MethodCandidate(Method method, const absl::StatusOr<TransferResult>& result);

// What one candidate's result is worth. Lengths are those of a source of kReferenceStature; nothing but
// MeshErrors::centred_pmd is centred.
struct EvaluationRow {
  std::string pair;
  std::string method;
  MeshErrors errors = {};
  double median_mm = 0;  // over the pair's vertices
  double p95_mm = 0;
  double seconds = 0;
  std::string failure = {};  // why there is no result; the numbers are then 0 and no mean counts them
};

// REQUIRES: candidate.positions, if any, has truth's row count; stature > 0 in the meshes' unit.
EvaluationRow Judge(const std::string& pair, const Candidate& candidate, const Points& truth,
                    const Faces& faces, double stature);

// A markdown table with a line per method in the order of first appearance. PMD, mean, MaxDist, ELR, EL, edge
// ratio error, Chamfer and centred PMD are means over pairs; "median mm" and "p95 mm" are each pair's
// quantiles over its vertices, averaged over pairs; "median PMD" is the median over pairs and "worst mm" the
// largest pair mean.
std::string SummaryMarkdown(const std::vector<EvaluationRow>& rows);

// One line per row after a header; SI units except where a column's name says otherwise.
std::string RowsCsv(const std::vector<EvaluationRow>& rows);

// The text as a field of a CSV file: quoted where it must be (RFC 4180).
std::string CsvField(const std::string& text);

// The q-quantile (0..1) of values, interpolated linearly; 0 for none.
double Quantile(std::vector<double> values, double q);

}  // namespace stance

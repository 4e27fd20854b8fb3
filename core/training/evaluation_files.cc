#include "core/training/evaluation_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "core/base/threads.h"
#include "core/mesh/measure.h"
#include "core/mesh/mesh_check.h"
#include "core/mesh/mesh_io.h"

namespace stance {
namespace {

// The parts of `line` between separators; empty ones are dropped.
std::vector<std::string> Fields(std::string_view line, std::string_view separators) {
  std::vector<std::string> parts;
  for (size_t begin = line.find_first_not_of(separators); begin != std::string_view::npos;) {
    const size_t end = std::min(line.find_first_of(separators, begin), line.size());
    parts.emplace_back(line.substr(begin, end - begin));
    begin = line.find_first_not_of(separators, end);
  }
  return parts;
}

// `status` with the line that it belongs to in front.
absl::Status AtLine(int line, const absl::Status& status) {
  const auto message = status.message();
  return absl::Status(status.code(),
                      fmt::format("line {}: {}", line, std::string_view(message.data(), message.size())));
}

absl::StatusOr<FileCase> ParseLine(std::string_view line, int number, const std::filesystem::path& folder) {
  const bool tabs = line.find('\t') != std::string_view::npos;
  const std::vector<std::string> parts = Fields(line, tabs ? "\t\r" : " \r");
  if (parts.size() != 3 && parts.size() != 4) {
    return absl::InvalidArgumentError(
        fmt::format("line {}: {} fields where \"source reference truth [stature]\" is expected: {}", number,
                    parts.size(), line));
  }
  FileCase item{.line = number,
                .source = folder / parts[0],
                .reference = folder / parts[1],
                .truth = folder / parts[2]};
  if (parts.size() == 4) {
    const char* end = parts[3].data() + parts[3].size();
    double stature = 0;
    const auto [stop, error] = std::from_chars(parts[3].data(), end, stature);
    if (error != std::errc() || stop != end || !std::isfinite(stature) || stature <= 0) {
      return absl::InvalidArgumentError(
          fmt::format("line {}: the stature is not a positive number: {}", number, parts[3]));
    }
    item.stature = stature;
  }
  return item;
}

absl::StatusOr<std::vector<EvaluationRow>> EvaluateCase(const FileCase& item, const Pipeline& pipeline,
                                                        const TransferOptions& options) {
  STANCE_ASSIGN_OR_RETURN(const TriangleMesh source, ReadMesh(item.source));
  STANCE_ASSIGN_OR_RETURN(const TriangleMesh reference, ReadMesh(item.reference));
  STANCE_ASSIGN_OR_RETURN(const TriangleMesh truth, ReadMesh(item.truth));
  STANCE_RETURN_IF_ERROR(CheckMesh(source, options.limits).status());
  STANCE_RETURN_IF_ERROR(CheckMesh(truth, options.limits).status());
  if (truth.vertex_count() != source.vertex_count()) {
    return absl::InvalidArgumentError(fmt::format("{} has {} vertices and its truth {} has {}",
                                                  item.source.string(), source.vertex_count(),
                                                  item.truth.string(), truth.vertex_count()));
  }
  const absl::StatusOr<TransferResult> result = pipeline.Transfer(source, reference, options);
  const Candidate method = MethodCandidate(options.method.value_or(pipeline.models().front().method), result);
  const Candidate unchanged{.method = "source left as it is", .positions = source.positions};
  const std::string name =
      fmt::format("{} as {}", item.source.stem().string(), item.reference.stem().string());
  const double stature = item.stature.value_or(EstimateStature(source.positions, source.faces));
  return std::vector<EvaluationRow>{Judge(name, method, truth.positions, source.faces, stature),
                                    Judge(name, unchanged, truth.positions, source.faces, stature)};
}

}  // namespace

absl::StatusOr<std::vector<FileCase>> ParseFileList(std::string_view text,
                                                    const std::filesystem::path& folder) {
  std::vector<FileCase> cases;
  int number = 0;
  while (!text.empty()) {
    ++number;
    const size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const size_t first = line.find_first_not_of(" \t\r");
    if (first == std::string_view::npos || line[first] == '#') continue;
    STANCE_ASSIGN_OR_RETURN(FileCase item, ParseLine(line, number, folder));
    cases.push_back(std::move(item));
  }
  if (cases.empty()) {
    return absl::InvalidArgumentError(fmt::format("the list has no case in its {} lines", number));
  }
  return cases;
}

absl::StatusOr<std::vector<EvaluationRow>> EvaluateFiles(const std::vector<FileCase>& cases,
                                                         const Pipeline& pipeline,
                                                         const TransferOptions& options, int threads) {
  std::vector<absl::StatusOr<std::vector<EvaluationRow>>> results(cases.size(), std::vector<EvaluationRow>());
  ParallelFor(static_cast<int64_t>(cases.size()), threads, 1, [&](int64_t begin, int64_t end) {
    for (int64_t i = begin; i < end; ++i) {
      results[static_cast<size_t>(i)] = EvaluateCase(cases[static_cast<size_t>(i)], pipeline, options);
    }
  });
  std::vector<EvaluationRow> rows;
  for (size_t i = 0; i < cases.size(); ++i) {
    if (!results[i].ok()) return AtLine(cases[i].line, results[i].status());
    for (EvaluationRow& row : *results[i]) rows.push_back(std::move(row));
  }
  return rows;
}

}  // namespace stance

// The evaluation of meshes on disk whose right answer is known.
#pragma once

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "core/training/evaluation.h"
#include "core/transfer/pipeline.h"

namespace stance {

struct FileCase {
  int line = 0;  // in the list, from 1
  std::filesystem::path source;
  std::filesystem::path reference;
  std::filesystem::path truth;  // the source's vertices, in its order, under the reference's pose
  std::optional<double> stature = std::nullopt;  // the source's, in its own unit
};

// A list with "source reference truth [stature]" per line, separated by spaces, or by tabs where names have
// spaces; without a stature the source's surface tells it (EstimateStature). Empty lines and
// those that begin with # are skipped. Relative paths start at `folder`. INVALID_ARGUMENT, naming the line,
// for anything else, and for a list without any case.
absl::StatusOr<std::vector<FileCase>> ParseFileList(std::string_view text,
                                                    const std::filesystem::path& folder);

// Two rows per case: the method, and the source left as it is. A mesh that can't be read, or a truth whose
// vertex count is not the source's, stops it with an error that names the line; a transfer that fails is a
// row's failure.
absl::StatusOr<std::vector<EvaluationRow>> EvaluateFiles(const std::vector<FileCase>& cases,
                                                         const Pipeline& pipeline,
                                                         const TransferOptions& options, int threads);

}  // namespace stance

#include "client/cli/rig_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <span>
#include <utility>
#include <vector>

namespace stance {
namespace {

// Text is put together here rather than by nlohmann::json, which would keep millions of weights as nodes and
// print float32 values with the digits of a double; fmt prints the shortest text that reads back the same.
using Buffer = fmt::memory_buffer;

template <typename... Args>
void Print(Buffer* out, fmt::format_string<Args...> format, Args&&... args) {
  fmt::format_to(std::back_inserter(*out), format, std::forward<Args>(args)...);
}

std::string Quoted(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
}

void PrintTree(Buffer* out, const JointTree& joints) {
  Print(out, "  \"names\": [");
  for (size_t j = 0; j < joints.names.size(); ++j) {
    Print(out, "{}{}", j > 0 ? ", " : "", Quoted(joints.names[j]));
  }
  Print(out, "],\n  \"parents\": [{}],\n", fmt::join(joints.parents, ", "));
}

void PrintPoints(Buffer* out, const Points& points) {
  Print(out, "[");
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    Print(out, "{}[{}, {}, {}]", i > 0 ? ", " : "", points(i, 0), points(i, 1), points(i, 2));
  }
  Print(out, "]");
}

void PrintNumbers(Buffer* out, const Eigen::VectorXf& numbers) {
  Print(out, "[{}]", fmt::join(numbers.begin(), numbers.end(), ", "));
}

// (joint, weight) of one vertex, heaviest first.
std::vector<std::pair<int, float>> Entries(const RowMatrix& weights, Eigen::Index vertex) {
  std::vector<std::pair<int, float>> entries;
  for (Eigen::Index j = 0; j < weights.cols(); ++j) {
    if (weights(vertex, j) > 0.0f) entries.emplace_back(static_cast<int>(j), weights(vertex, j));
  }
  std::stable_sort(entries.begin(), entries.end(),
                   [](const auto& a, const auto& b) { return a.second > b.second; });
  return entries;
}

void PrintWeights(Buffer* out, const RowMatrix& weights) {
  std::vector<int64_t> offsets = {0};
  std::vector<int> joints;
  std::vector<float> values;
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    for (const auto& [joint, weight] : Entries(weights, v)) {
      joints.push_back(joint);
      values.push_back(weight);
    }
    offsets.push_back(static_cast<int64_t>(values.size()));
  }
  Print(out, "  \"vertex_count\": {},\n  \"joint_count\": {},\n", weights.rows(), weights.cols());
  Print(out, "  \"row_offsets\": [{}],\n", fmt::join(offsets, ","));
  Print(out, "  \"joint_indices\": [{}],\n", fmt::join(joints, ","));
  Print(out, "  \"weights\": [{}]\n", fmt::join(values, ","));
}

}  // namespace

std::string SkeletonJson(const TransferAnswer& answer) {
  const TransferResult& result = answer.result;
  Buffer out;
  Print(&out, "{{\n  \"format\": \"stance-skeleton-1\",\n");
  PrintTree(&out, answer.joints);
  Print(&out, "  \"joints\": {{\n    \"source\": ");
  PrintPoints(&out, result.source_rig.joints);
  Print(&out, ",\n    \"reference\": ");
  PrintPoints(&out, result.reference_rig.joints);
  Print(&out, ",\n    \"target\": ");
  PrintPoints(&out, result.target_joints);
  Print(&out, "\n  }},\n");
  if (result.source_rig.confidence.size() > 0 && result.reference_rig.confidence.size() > 0) {
    Print(&out, "  \"confidence\": {{\n    \"source\": ");
    PrintNumbers(&out, result.source_rig.confidence);
    Print(&out, ",\n    \"reference\": ");
    PrintNumbers(&out, result.reference_rig.confidence);
    Print(&out, "\n  }},\n");
  }
  Print(&out, "  \"transforms\": [");
  for (size_t j = 0; j < result.transforms.size(); ++j) {
    const AffineTransform& transform = result.transforms[j];
    Print(&out, "{}\n    [", j > 0 ? "," : "");
    for (int row = 0; row < 3; ++row) {
      Print(&out, "{}[{}, {}, {}, {}]", row > 0 ? ", " : "", transform.linear(row, 0),
            transform.linear(row, 1), transform.linear(row, 2), transform.translation(row));
    }
    Print(&out, "]");
  }
  Print(&out, "\n  ]\n}}\n");
  return fmt::to_string(out);
}

std::string RigJson(const RigAnswer& answer) {
  Buffer out;
  Print(&out, "{{\n  \"format\": \"stance-rig-1\",\n");
  PrintTree(&out, answer.joints);
  Print(&out, "  \"joints\": ");
  PrintPoints(&out, answer.result.rig.joints);
  Print(&out, ",\n");
  if (answer.result.rig.confidence.size() > 0) {
    Print(&out, "  \"confidence\": ");
    PrintNumbers(&out, answer.result.rig.confidence);
    Print(&out, ",\n");
  }
  PrintWeights(&out, answer.result.rig.weights);
  Print(&out, "}}\n");
  return fmt::to_string(out);
}

std::string WeightsJson(const JointTree& joints, const RowMatrix& weights) {
  Buffer out;
  Print(&out, "{{\n  \"format\": \"stance-weights-1\",\n");
  PrintTree(&out, joints);
  PrintWeights(&out, weights);
  Print(&out, "}}\n");
  return fmt::to_string(out);
}

std::string WeightsCsv(const JointTree& joints, const RowMatrix& weights) {
  Buffer out;
  Print(&out, "vertex,joint,name,weight\n");
  for (Eigen::Index v = 0; v < weights.rows(); ++v) {
    for (const auto& [joint, weight] : Entries(weights, v)) {
      Print(&out, "{},{},{},{}\n", v, joint, joints.names[joint], weight);
    }
  }
  return fmt::to_string(out);
}

}  // namespace stance

#include "core/training/training_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "core/base/files.h"

namespace stance {
namespace {

// The comma-separated numbers of a line; none if something else is in it.
std::vector<double> Numbers(const std::string& line) {
  std::vector<double> numbers;
  const char* at = line.c_str();
  for (;;) {
    char* end = nullptr;
    numbers.push_back(std::strtod(at, &end));
    if (end == at || (*end != ',' && *end != '\0')) return {};
    if (*end == '\0') return numbers;
    at = end + 1;
  }
}

}  // namespace

absl::Status AppendLog(const std::filesystem::path& csv, const LogRow& row) {
  const bool fresh = !std::filesystem::exists(csv);
  std::ofstream out(csv, std::ios::app);
  if (fresh) out << "seen,seconds,loss,accuracy,joint_mm,degrees,transfer_mm,learning_rate\n";
  out << fmt::format("{},{:.1f},{:.6g},{:.5f},{:.3f},{:.3f},{:.3f},{:.3e}\n", row.seen, row.seconds, row.loss,
                     row.accuracy, row.joint_mm, row.degrees, row.transfer_mm, row.learning_rate);
  out.close();
  if (!out) return absl::UnavailableError(fmt::format("{}: could not append", csv.string()));
  return absl::OkStatus();
}

absl::StatusOr<std::vector<LogRow>> ReadLog(const std::filesystem::path& csv) {
  STANCE_ASSIGN_OR_RETURN(const std::string text, ReadFile(csv));
  std::istringstream lines(text);
  std::string line;
  std::getline(lines, line);
  std::vector<LogRow> rows;
  while (std::getline(lines, line)) {
    const std::vector<double> v = Numbers(line);
    // Logs from before rotations, or transfers, were learned have six or seven columns: a stage that has one
    // goes on with it.
    if (v.size() < 6 || v.size() > 8) {
      return absl::DataLossError(
          fmt::format("{}: row {} is malformed: '{}'", csv.string(), rows.size() + 2, line));
    }
    rows.push_back(
        {v[0], v[1], v[2], v[3], v[4], v.size() > 6 ? v[5] : 0, v.size() > 7 ? v[6] : 0, v.back()});
  }
  return rows;
}

absl::Status WriteLossPlot(const std::vector<LogRow>& rows, const std::string& title,
                           const std::filesystem::path& svg) {
  constexpr double kWidth = 720, kHeight = 400, kLeft = 70, kBottom = 50, kTop = 40, kRight = 20;
  std::vector<std::pair<double, double>> points;  // log10
  for (const LogRow& row : rows) {
    if (row.seen > 0 && row.loss > 0) points.emplace_back(std::log10(row.seen), std::log10(row.loss));
  }
  if (points.empty()) return absl::OkStatus();
  double x0 = points.front().first, x1 = points.back().first, y0 = points[0].second, y1 = y0;
  for (const auto& [x, y] : points) {
    y0 = std::min(y0, y);
    y1 = std::max(y1, y);
  }
  x1 = std::max(x1, x0 + 1e-3);
  y1 = std::max(y1, y0 + 1e-3);
  const auto px = [&](double x) { return kLeft + (x - x0) / (x1 - x0) * (kWidth - kLeft - kRight); };
  const auto py = [&](double y) {
    return kHeight - kBottom - (y - y0) / (y1 - y0) * (kHeight - kBottom - kTop);
  };
  std::string out = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{0}' height='{1}' font-family='sans-serif' "
      "font-size='12'>"
      "<rect width='{0}' height='{1}' fill='white'/><text x='{2}' y='24' font-size='15'>{3}</text>",
      kWidth, kHeight, kLeft, title);
  for (int tick = 0; tick <= 4; ++tick) {
    const double x = x0 + (x1 - x0) * tick / 4, y = y0 + (y1 - y0) * tick / 4;
    out += fmt::format(
        "<line x1='{0:.1f}' y1='{1}' x2='{0:.1f}' y2='{2}' stroke='#ddd'/><text x='{0:.1f}' y='{3}' "
        "text-anchor='middle'>{4:.3g}</text>",
        px(x), kTop, kHeight - kBottom, kHeight - kBottom + 18, std::pow(10, x));
    out += fmt::format(
        "<line x1='{0}' y1='{1:.1f}' x2='{2}' y2='{1:.1f}' stroke='#ddd'/><text x='{3}' y='{4:.1f}' "
        "text-anchor='end'>{5:.3g}</text>",
        kLeft, py(y), kWidth - kRight, kLeft - 6, py(y) + 4, std::pow(10, y));
  }
  out += fmt::format(
      "<text x='{}' y='{}' text-anchor='middle'>characters seen</text><polyline fill='none' "
      "stroke='#1f5fa8' stroke-width='1.5' points='",
      kWidth / 2, kHeight - 12);
  for (const auto& [x, y] : points) out += fmt::format("{:.1f},{:.1f} ", px(x), py(y));
  return WriteFile(svg, out + "'/></svg>\n");
}

}  // namespace stance

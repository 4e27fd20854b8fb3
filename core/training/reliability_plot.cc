#include "core/training/reliability_plot.h"

#include <fmt/format.h>

#include "core/base/check.h"

namespace stance {
namespace {

constexpr double kSide = 400, kLeft = 60, kTop = 40, kBottom = 50, kRight = 20;

double X(double probability) { return kLeft + probability * kSide; }
double Y(double fraction) { return kTop + (1 - fraction) * kSide; }

// The left (0) or the right (1) half of each bin that has claims.
std::string Bars(std::span<const ReliabilityBin> bins, int half, const char* name, const char* color) {
  std::string out;
  for (const ReliabilityBin& bin : bins) {
    if (bin.count == 0) continue;
    const double width = X(bin.high) - X(bin.low), gap = 0.08 * width, bar = width / 2 - gap;
    const double left = X(bin.low) + (half == 0 ? gap : width / 2);
    out += fmt::format(
        "<rect class='{}' x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}' fill='{}'>"
        "<title>{} claims, mean {:.3f}, right {:.3f}</title></rect>"
        "<circle cx='{:.1f}' cy='{:.1f}' r='2.5' fill='black'/>\n",
        name, left, Y(bin.mean_outcome), bar, Y(0) - Y(bin.mean_outcome), color, bin.count,
        bin.mean_probability, bin.mean_outcome, left + bar / 2, Y(bin.mean_probability));
  }
  return out;
}

std::string Legend(double y, const char* color, const char* name, std::span<const ReliabilityBin> bins) {
  return fmt::format(
      "<rect x='{0}' y='{1}' width='12' height='12' fill='{2}'/><text x='{3}' y='{4}'>{5}, ECE "
      "{6:.3f}</text>\n",
      X(0.03), y, color, X(0.03) + 18, y + 10, name, ExpectedCalibrationError(bins));
}

}  // namespace

std::string ReliabilityPlot(std::span<const ReliabilityBin> before, std::span<const ReliabilityBin> after) {
  STANCE_CHECK(before.size() == after.size());
  constexpr char kBefore[] = "#9db8d9", kAfter[] = "#e2883c";
  const double width = kLeft + kSide + kRight, height = kTop + kSide + kBottom;
  std::string out = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{0}' height='{1}' font-family='sans-serif' "
      "font-size='12'>\n<rect width='{0}' height='{1}' fill='white'/>"
      "<text x='{2}' y='24' font-size='15'>Confidence of joints: stated and true</text>\n",
      width, height, kLeft);
  for (int tick = 0; tick <= 5; ++tick) {
    const double at = tick / 5.0;
    out += fmt::format(
        "<line x1='{0}' y1='{2:.1f}' x2='{1}' y2='{2:.1f}' stroke='#ddd'/>"
        "<text x='{3}' y='{4:.1f}' text-anchor='end'>{5:.1f}</text>"
        "<text x='{6:.1f}' y='{7}' text-anchor='middle'>{5:.1f}</text>\n",
        X(0), X(1), Y(at), kLeft - 6, Y(at) + 4, at, X(at), Y(0) + 18);
  }
  out += Bars(before, 0, "before", kBefore) + Bars(after, 1, "after", kAfter);
  out += fmt::format("<line x1='{}' y1='{}' x2='{}' y2='{}' stroke='#444' stroke-dasharray='5 4'/>\n", X(0),
                     Y(0), X(1), Y(1));
  out += Legend(kTop + 8, kBefore, "before", before) + Legend(kTop + 26, kAfter, "after", after);
  out += fmt::format(
      "<text x='{}' y='{}' text-anchor='middle'>stated probability</text>"
      "<text transform='translate(16 {}) rotate(-90)' text-anchor='middle'>fraction right</text>\n</svg>\n",
      X(0.5), height - 12, Y(0.5));
  return out;
}

}  // namespace stance

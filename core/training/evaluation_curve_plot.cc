#include "core/training/evaluation_curve_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace stance {
namespace {

// Pixels. A panel's margins hold its labels.
constexpr double kPanelWidth = 420, kPanelHeight = 300, kTitle = 36;
constexpr double kLeft = 56, kRight = 24, kTop = 30, kBottom = 52;
constexpr int kColumns = 2;

// A step of 1, 2 or 5 times a power of ten that divides 0..top into three to seven pieces.
double TickStep(double top) {
  const double rough = top / 5, power = std::pow(10, std::floor(std::log10(rough)));
  for (const double step : {1.0, 2.0, 5.0}) {
    if (step * power >= rough) return step * power;
  }
  return 10 * power;
}

std::string Panel(const Curve& curve, const std::vector<CurvePoint>& points, double top, double left,
                  double above) {
  const auto scaled = [&curve](double level) { return curve.logarithmic ? std::log10(level) : level; };
  const double x0 = scaled(curve.levels.front()), x1 = std::max(scaled(curve.levels.back()), x0 + 1e-9);
  const double bottom = above + kPanelHeight - kBottom, right = left + kPanelWidth - kRight;
  const auto px = [&](double level) {
    return left + kLeft + (scaled(level) - x0) / (x1 - x0) * (kPanelWidth - kLeft - kRight);
  };
  const auto py = [&](double mm) { return bottom - mm / top * (kPanelHeight - kBottom - kTop); };
  std::string out =
      fmt::format("<text x='{}' y='{}' font-size='13'>{}</text>", left + kLeft, above + 18, curve.name);
  for (const double level : curve.levels) {
    out += fmt::format(
        "<line x1='{0:.1f}' y1='{1:.1f}' x2='{0:.1f}' y2='{2:.1f}' stroke='#eee'/>"
        "<text x='{0:.1f}' y='{3:.1f}' text-anchor='middle' font-size='10'>{4:.6g}</text>",
        px(level), above + kTop, bottom, bottom + 15, level);
  }
  for (double mm = 0; mm <= top * (1 + 1e-9); mm += TickStep(top)) {
    out += fmt::format(
        "<line x1='{0:.1f}' y1='{1:.1f}' x2='{2:.1f}' y2='{1:.1f}' stroke='#ddd'/>"
        "<text x='{3:.1f}' y='{4:.1f}' text-anchor='end'>{5:.3g}</text>",
        left + kLeft, py(mm), right, left + kLeft - 6, py(mm) + 4, mm);
  }
  out += fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='middle'>{}</text>", (left + kLeft + right) / 2,
                     bottom + 34, curve.unit);
  std::string line, dots;
  for (const CurvePoint& point : points) {
    if (point.pairs == 0) continue;
    line += fmt::format("{:.1f},{:.1f} ", px(point.level), py(point.mean_mm));
    dots += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='3' fill='#1f5fa8'/>", px(point.level),
                        py(point.mean_mm));
  }
  return out +
         fmt::format("<polyline fill='none' stroke='#1f5fa8' stroke-width='1.5' points='{}'/>{}", line, dots);
}

}  // namespace

std::string CurvesSvg(const std::string& title, const std::vector<Curve>& curves,
                      const std::vector<CurveRow>& rows) {
  std::vector<std::vector<CurvePoint>> points;
  double most = 1;  // millimetre, so that perfect transfers have an axis too
  for (const Curve& curve : curves) {
    points.push_back(CurvePoints(curve, rows));
    for (const CurvePoint& point : points.back()) most = std::max(most, point.mean_mm);
  }
  const double top = std::ceil(most / TickStep(most)) * TickStep(most);
  const auto panels = static_cast<int>(curves.size());
  std::string out = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' width='{0}' height='{1}' font-family='sans-serif' "
      "font-size='11'><rect width='{0}' height='{1}' fill='white'/>"
      "<text x='{2}' y='24' font-size='15'>{3}</text>",
      kPanelWidth * std::min(panels, kColumns), kTitle + kPanelHeight * ((panels + kColumns - 1) / kColumns),
      kLeft, title);
  for (int i = 0; i < panels; ++i) {
    out += Panel(curves[i], points[i], top, kPanelWidth * (i % kColumns),
                 kTitle + kPanelHeight * (i / kColumns));
  }
  return out + "</svg>\n";
}

}  // namespace stance

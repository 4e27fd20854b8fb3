#include "core/training/reliability_plot.h"

#include <gtest/gtest.h>

namespace stance {
namespace {

int Count(const std::string& text, const std::string& part) {
  int count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

TEST(ReliabilityPlot, HasABarPerBinWithClaimsAndTheDiagonal) {
  const auto before = Reliability(std::vector<Claim>{{0.15, 0}, {0.55, 1}, {0.95, 1}});
  const auto after = Reliability(std::vector<Claim>{{0.15, 0}, {0.95, 1}, {0.96, 0}});
  const std::string svg = ReliabilityPlot(before, after);
  EXPECT_EQ(svg.rfind("<svg ", 0), 0u);
  EXPECT_EQ(svg.substr(svg.size() - 7), "</svg>\n");
  EXPECT_EQ(Count(svg, "class='before'"), 3);
  EXPECT_EQ(Count(svg, "class='after'"), 2);
  EXPECT_EQ(Count(svg, "stroke-dasharray"), 1);
  EXPECT_EQ(Count(svg, "2 claims, mean 0.955, right 0.500"), 1);
}

TEST(ReliabilityPlot, OfNoClaimsIsEmptyAxes) {
  const std::string svg = ReliabilityPlot(Reliability({}), Reliability({}));
  EXPECT_EQ(Count(svg, "class="), 0);
  EXPECT_EQ(Count(svg, "nan"), 0);
}

}  // namespace
}  // namespace stance

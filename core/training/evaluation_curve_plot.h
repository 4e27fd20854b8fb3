// Curves of errors as a picture.
#pragma once

#include <string>
#include <vector>

#include "core/training/evaluation_curves.h"

namespace stance {

// An SVG with a panel per curve, two in a row: the mean error in millimetres over the level. All panels have
// the same vertical axis, from 0. Levels without a transferred pair have no point.
std::string CurvesSvg(const std::string& title, const std::vector<Curve>& curves,
                      const std::vector<CurveRow>& rows);

}  // namespace stance

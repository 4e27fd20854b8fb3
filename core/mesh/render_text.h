// Captions in a built-in 5x7 bitmap font.
#pragma once

#include <string_view>

#include "core/mesh/render.h"

namespace stance {

// Pixels that one line of text takes when every font pixel is scale x scale image pixels.
int TextWidth(std::string_view text, int scale);
int TextHeight(int scale);

// Writes one line of printable ASCII in dark grey, its upper left corner at (left, top); any other byte shows
// as a question mark. What lies outside the image is cut off.
void DrawText(Image& image, int left, int top, int scale, std::string_view text);

}  // namespace stance

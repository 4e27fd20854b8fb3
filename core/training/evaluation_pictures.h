// Transfers as rows of pictures, for looking at what the numbers mean.
#pragma once

#include "core/mesh/render.h"
#include "core/transfer/pipeline.h"

namespace stance {

struct PictureOptions {
  RenderOptions render = {};
  bool skeletons = false;  // the predicted skeletons over source, reference and target
  bool weights = false;    // colour source and target by the predicted weights, a colour per joint
  UpAxis source_up = UpAxis::kY;
  UpAxis reference_up = UpAxis::kY;
};

// What the error tile shows at its strongest colour.
inline constexpr double kFullColorErrorMm = 100.0;

// One row: source | reference | target, and with a truth (V of source, 3) also | truth | the target coloured
// by its distance from the truth, the caption giving the mean for a character of kReferenceStature.
Image RenderTransfer(const TriangleMesh& source, const TriangleMesh& reference, const TransferResult& result,
                     const Points* truth, double stature, const PictureOptions& options);

}  // namespace stance

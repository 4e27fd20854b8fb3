// One mesh seen in several ways: turned and mirrored copies, whose estimates are averaged.
#pragma once

#include <span>
#include <vector>

#include "core/network/pose_model.h"
#include "core/network/pyramid_input.h"

namespace stance {

// A copy of the mesh, mirrored in the plane x = 0 or not, then turned about the origin.
struct PoseView {
  Rotation turn = Rotation::Identity();
  bool mirrored = false;
};

// `count` views: half turned evenly about y, the other half their mirror images (of one or of an odd number,
// none is). REQUIRES: count >= 1.
std::vector<PoseView> EvenViews(int count);

// The five quarter and half turns about x and z that set a mesh on its other sides: one of them, or none,
// brings any up axis to within 55 degrees of +y.
std::vector<PoseView> OtherSides();

PyramidInput ViewedInput(const PyramidInput& input, const PoseView& view);

// The estimate of a viewed input as one of the input itself.
PoseEstimate EstimateBehindView(PoseEstimate estimate, const PoseView& view);

// The means of weights, places, joints and confidences, and of rotations the rotation nearest to the mean.
// REQUIRES: at least one, all of the same samples.
PoseEstimate MeanEstimate(std::span<const PoseEstimate> estimates);

}  // namespace stance

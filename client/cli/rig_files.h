// The JSON and CSV files for skeletons and weights; docs/cli.md describes them.
#pragma once

#include <string>

#include "client/answers.h"
#include "core/base/types.h"

namespace stance {

// Names, parents, the joints of source, reference and target, the confidences where the method knows them,
// and the transforms.
std::string SkeletonJson(const TransferAnswer& answer);

// Names, parents, joints, confidences where the method knows them, and weights of one mesh.
std::string RigJson(const RigAnswer& answer);

// The positive entries of `weights` (V, J) as compressed sparse rows, in descending order within a vertex.
std::string WeightsJson(const JointTree& joints, const RowMatrix& weights);

// A header, then "vertex,joint,name,weight", one line per positive entry, in the same order.
std::string WeightsCsv(const JointTree& joints, const RowMatrix& weights);

}  // namespace stance

#include "core/training/subdivision.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace stance {
namespace {

using Edge = std::pair<int32_t, int32_t>;  // the smaller index first
using Corners = std::array<int32_t, 3>;

// Of the edges, how many one round cuts: few enough that a long edge's halves are cut again before short
// edges are cut once.
constexpr int64_t kRoundsShare = 4;

Edge EdgeOf(int32_t a, int32_t b) { return {std::min(a, b), std::max(a, b)}; }

std::vector<Edge> UndirectedEdges(const Faces& faces) {
  std::vector<Edge> edges;
  edges.reserve(static_cast<size_t>(faces.size()));
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    for (int c = 0; c < 3; ++c) {
      const Edge edge = EdgeOf(faces(f, c), faces(f, (c + 1) % 3));
      if (edge.first != edge.second) edges.push_back(edge);
    }
  }
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  return edges;
}

// The `count` longest edges, ascending; of equally long ones those that come first.
std::vector<Edge> Longest(const Points& positions, const std::vector<Edge>& edges, int64_t count) {
  std::vector<float> lengths(edges.size());
  for (size_t e = 0; e < edges.size(); ++e) {
    lengths[e] = (positions.row(edges[e].first) - positions.row(edges[e].second)).squaredNorm();
  }
  std::vector<int32_t> order(edges.size());
  std::iota(order.begin(), order.end(), 0);
  std::nth_element(order.begin(), order.begin() + (count - 1), order.end(), [&](int32_t a, int32_t b) {
    return lengths[a] != lengths[b] ? lengths[a] > lengths[b] : a < b;
  });
  order.resize(static_cast<size_t>(count));
  std::sort(order.begin(), order.end());
  std::vector<Edge> longest;
  for (const int32_t e : order) longest.push_back(edges[e]);
  return longest;
}

// The pieces of a face with corners v, whose edge from v[c] to its next corner is cut at m[c] unless m[c] is
// negative.
void SplitFace(Corners v, Corners m, const Points& positions, std::vector<int32_t>& corners) {
  const auto emit = [&corners](int32_t a, int32_t b, int32_t c) { corners.insert(corners.end(), {a, b, c}); };
  const auto rotate = [&v, &m] {
    std::rotate(v.begin(), v.begin() + 1, v.end());
    std::rotate(m.begin(), m.begin() + 1, m.end());
  };
  switch (std::count_if(m.begin(), m.end(), [](int32_t middle) { return middle >= 0; })) {
    case 0:
      emit(v[0], v[1], v[2]);
      return;
    case 1:
      while (m[0] < 0) rotate();
      emit(v[0], m[0], v[2]);
      emit(m[0], v[1], v[2]);
      return;
    case 2:
      while (m[2] >= 0) rotate();
      emit(m[0], v[1], m[1]);
      // The rest has four corners: the shorter diagonal makes the better triangles.
      if ((positions.row(v[0]) - positions.row(m[1])).squaredNorm() <=
          (positions.row(m[0]) - positions.row(v[2])).squaredNorm()) {
        emit(v[0], m[0], m[1]);
        emit(v[0], m[1], v[2]);
      } else {
        emit(v[0], m[0], v[2]);
        emit(m[0], m[1], v[2]);
      }
      return;
    default:
      emit(v[0], m[0], m[2]);
      emit(m[0], v[1], m[1]);
      emit(m[2], m[1], v[2]);
      emit(m[0], m[1], m[2]);
  }
}

// `cut` (ascending) have the vertices first_middle, first_middle + 1, ... in their middles.
Faces SplitFaces(const Points& positions, const Faces& faces, const std::vector<Edge>& cut,
                 int32_t first_middle) {
  const auto middle = [&](int32_t a, int32_t b) {
    const auto place = std::lower_bound(cut.begin(), cut.end(), EdgeOf(a, b));
    if (place == cut.end() || *place != EdgeOf(a, b)) return -1;
    return first_middle + static_cast<int32_t>(place - cut.begin());
  };
  std::vector<int32_t> corners;
  corners.reserve(static_cast<size_t>(faces.size()) * 2);
  for (Eigen::Index f = 0; f < faces.rows(); ++f) {
    const Corners v = {faces(f, 0), faces(f, 1), faces(f, 2)};
    SplitFace(v, {middle(v[0], v[1]), middle(v[1], v[2]), middle(v[2], v[0])}, positions, corners);
  }
  return Eigen::Map<const Faces>(corners.data(), static_cast<Eigen::Index>(corners.size() / 3), 3);
}

}  // namespace

Subdivision SubdivideLongestEdges(const Points& positions, const Faces& faces, int64_t count) {
  Subdivision result{.faces = faces, .parents = {}};
  Points all = positions;
  while (all.rows() < count) {
    const std::vector<Edge> edges = UndirectedEdges(result.faces);
    if (edges.empty()) break;
    const int64_t round = (std::ssize(edges) + kRoundsShare - 1) / kRoundsShare;
    const std::vector<Edge> cut = Longest(all, edges, std::min<int64_t>(count - all.rows(), round));
    std::vector<std::array<int32_t, 2>> parents;
    for (const auto& [a, b] : cut) parents.push_back({a, b});
    const auto first_middle = static_cast<int32_t>(all.rows());
    all = WithMidpoints(all, parents);
    result.faces = SplitFaces(all, result.faces, cut, first_middle);
    result.parents.insert(result.parents.end(), parents.begin(), parents.end());
  }
  return result;
}

}  // namespace stance

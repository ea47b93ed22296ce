// The edges of the level after one, in the order of their numbers.
#pragma once

#include <Eigen/Core>
#include <algorithm>

#include "core/geometry/mesh_topology.h"

namespace rilievo {

// Face f of `parent` meets nine edges of the next level in its three corner children, in the order
//   e0 at v0, inner 0, e2 at v0 | e0 at v1, e1 at v1, inner 1 | inner 2, e1 at v2, e2 at v2
// where "e0 at v0" is the half of edge 0 at corner 0, new unless an earlier face met edge 0, and
// inner c is the edge between child c and the middle one. Calls half(f, k, corner) and inner(f, c)
// for the new ones.
template <typename Half, typename Inner>
void ForEachChildEdge(const MeshTopology& parent, const Half& half, const Inner& inner) {
  int met = 0;  // edges of the parent met so far: exactly those of smaller number
  for (int f = 0; f < parent.face_count(); ++f) {
    const Eigen::Vector3i edges = parent.face_edges.col(f);
    const auto half_if_new = [&](int k, int corner) {
      if (edges[k] >= met) half(f, k, corner);
    };
    half_if_new(0, 0);
    inner(f, 0);
    half_if_new(2, 0);
    half_if_new(0, 1);
    half_if_new(1, 1);
    inner(f, 1);
    inner(f, 2);
    half_if_new(1, 2);
    half_if_new(2, 2);
    met = std::max(met, edges.maxCoeff() + 1);
  }
}

}  // namespace rilievo

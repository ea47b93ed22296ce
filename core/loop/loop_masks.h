// Loop's masks (Loop 1987; boundaries by the cubic B-spline rule of Hoppe et al. 1994).
#pragma once

#include <vector>

namespace rilievo {

// Subdivision: interior edge 3/8 3/8 (its ends), 1/8 1/8 (opposite corners); boundary edge 1/2 1/2;
// interior vertex LoopBeta a neighbour; boundary vertex 3/4, and 1/8 for each boundary neighbour,
// whatever its valence: a corner of one face is smooth too (OpenSubdiv's "edge only" boundary).

// Weight of each neighbour in the subdivision of an interior vertex of this valence, Loop 1987:
// beta(n) = (5/8 - (3/8 + cos(2 pi / n)/4)^2) / n.
double LoopBeta(int valence);

// Weight of each neighbour in the limit position of an interior vertex: 1 / (n + 3 / (8 beta)).
// The vertex itself weighs 1 - n times that.
double LoopLimitWeight(int valence);

// Weights of the vertex itself and of its neighbours in counter-clockwise order (as in VertexRings:
// on the boundary from the outgoing to the incoming boundary edge). `position` sums to one, the
// tangents to zero; tangent_u x tangent_v points outward.
struct LoopLimitMask {
  double position_self = 1.0, tangent_u_self = 0.0, tangent_v_self = 0.0;
  std::vector<double> position, tangent_u, tangent_v;  // one per neighbour
};

// Interior, valence n >= 2: tangents cos(2 pi i / n) and sin(2 pi i / n).
//
// Boundary, valence n >= 2, k = n - 1 faces: position 1/6 2/3 1/6; tangent_u along the boundary,
// p_0 - p_k. tangent_v across it is the left eigenvector of the subdivision matrix that varies as
// sin(i theta) over the inner neighbours, theta = pi / k, of eigenvalue 3/8 + cos(theta)/4:
//   neighbours 0 and k    -sin(theta) cos(theta)
//   neighbour 0 < i < k   (1 - cos(theta)) (1 + 2 cos(theta)) sin(i theta)
//   the vertex itself     -sin(theta)
// For k = 1 it is p_0 + p_1 - 2 p. Hoppe et al. 1994 list other weights for k > 3: those go with a
// changed edge rule beside irregular boundary vertices, which is not used here. For k > 6 the mode
// sin(2 i theta) shrinks more slowly than tangent_u: the surface has no tangent plane there, and
// the normal is that of the boundary curve and of the slowest mode across it.
LoopLimitMask InteriorLimitMask(int valence);
LoopLimitMask BoundaryLimitMask(int valence);

}  // namespace rilievo

// Masks of vertices with sharp edges: Loop's rules with creases, darts and corners (Hoppe et al.
// 1994), semi-sharp ones included (DeRose, Kass, Truong 1998, uniform creasing).
#pragma once

#include <vector>

namespace rilievo {

// Subdivision, where an edge has sharpness s. The edge's own new vertex: w = min(s, 1) times the
// midpoint, plus 1 - w times the smooth mask, whatever its ends (OpenSubdiv's rule; Hoppe et al.
// change it beside darts and irregular crease vertices). Both halves have sharpness s - 1, not
// below 0; s >= kInfiniteSharpness stays. A vertex: the smooth mask where it is smooth or a dart;
// 3/4, and 1/8 for the other ends of its two sharp edges, where it is a crease; itself alone where
// it is a corner. When sharpnesses that reach zero change its kind, the mask of the old kind weighs
// their mean, not above 1, and that of the new kind the rest.

// What is sharp around a vertex.
struct SharpRing {
  std::vector<float> sharpness;  // of its edges, counter-clockwise as in VertexRings; 0 is smooth
  bool boundary = false;         // first and last edge are the boundary, of kInfiniteSharpness
  bool corner = false;           // listed in ControlMesh::corners
};

// Sharpness of the halves of an edge.
float SharpnessOfHalves(float sharpness);

// The vertex on the next level: weights of itself [0] and of its neighbours [1 + i].
std::vector<double> SharpVertexWeights(const SharpRing& ring);

// One side of a sharp vertex: the faces between edge `first` and edge first + face_count (modulo
// the valence), or all of them. Tangents as in LoopLimitMask: the side's normal is
// tangent_u x tangent_v, outward. Weights of the vertex itself [0] and of its neighbours [1 + i].
struct SharpSector {
  int first = 0, face_count = 0;
  std::vector<double> tangent_u, tangent_v;
};

// Limit masks on the ring of a vertex. Exact for every sharpness: the masks of the ring that is
// left when all semi-sharp edges are smooth, drawn back through the subdivision matrices up to
// there.
struct SharpLimitMask {
  std::vector<double> position;  // of the vertex itself [0] and of its neighbours [1 + i]
  // Two or more where the limit surface has a crease or corner, else one.
  std::vector<SharpSector> sectors;
  // The only side; or, if there are more, the smooth tangents of the whole ring, between the sides.
  SharpSector whole;
};

// Position and sectors by the kind of the vertex once semi-sharp edges are gone, valence n:
//
// Smooth: InteriorLimitMask. (A boundary vertex is a crease vertex of one side.)
//
// Dart. With p_0 the end of the sharp edge, c = cosh, phi = arcosh(5/2), beta = LoopBeta(n), the
// left eigenvector of eigenvalue 1 is, before division by its sum,
//   itself 1, p_i  8 beta/3 (1 - c((i - n/2) phi) / c(n phi/2)), p_0  2 beta + p_1 / 2.
// OpenSubdiv takes the smooth mask here, which is another point than its own subdivision tends to.
// The subdominant pair: sin(2 pi i / n) of eigenvalue 3/8 + cos(2 pi / n)/4, and a symmetric vector
// cos((i - n/2) theta) - cos(n theta/2) at p_i of eigenvalue 3/8 + cos(theta)/4, theta the root of
// its secular equation (see crease_masks.cc). These two lead for all n: one normal, no split.
//
// Crease: 1/6 2/3 1/6 along the crease. Either side is a boundary: the tangents of
// BoundaryLimitMask on its edges.
//
// Corner: the vertex itself. The sides lie between successive sharp edges; on one of k faces, a and
// b its first and last neighbour, tangent_u = a - b, and tangent_v = a + b - 2 p for k = 1, else
// the sum of sin(i pi / k) (p_i - p) over its inner neighbours. For flat sides and for k = 1 that
// is the plane of a - p and b - p. Those two alone (the masks of Hoppe et al. and of OpenSubdiv)
// span no plane where a crease runs straight on through a corner, and turn the normal round where a
// side is wider than 180 degrees; and for k > 3 the surface has no tangent plane in the corner, for
// sin(i pi / k) shrinks more slowly than they. The directions here are taken at the level that
// first holds the vertex. With fewer than two sharp edges a corner has one side, with the smooth
// tangents.
SharpLimitMask SharpLimit(const SharpRing& ring);

}  // namespace rilievo

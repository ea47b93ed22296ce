// Masks of Catmull-Clark surfaces over quads (Catmull and Clark 1978), with boundaries, creases,
// darts and corners as in crease_masks.h, semi-sharp ones included.
#pragma once

#include <vector>

#include "core/loop/crease_masks.h"

namespace rilievo {

// Subdivision. The new vertex of a quad: the mean of its corners. That of an edge inside: the mean
// of its ends and of the quads' new vertices beside it, so 3/8 for each end and 1/16 for the other
// corners of both quads; of an edge of sharpness s that mask and the middle as in crease_masks.h. A
// smooth vertex with n edges: 1 - 7/(4 n) of itself, 3/(2 n^2) of each neighbour along an edge, and
// 1/(4 n^2) of each corner opposite to it in a quad. A boundary vertex: 3/4, and 1/8 for each
// boundary neighbour, whatever its valence.

// Weights are of the vertex itself [0], of its neighbours p along edges [1 + i], counter-clockwise
// as in `ring`, and of the corners q opposite to it [1 + n + i], q_i in the quad between edges i
// and i + 1. `SharpSector::first` and `face_count` count edges and quads.

// The vertex on the next level.
std::vector<double> QuadVertexWeights(const SharpRing& ring);

// Limit masks, exact for every sharpness as in crease_masks.h. By the kind of the vertex:
//
// Smooth, n edges: position n^2 itself, 4 each neighbour, 1 each opposite corner, over n (n + 5).
// Tangents (Halstead, Kass, DeRose 1993): weights a c_i of p_i and c_i + c_{i+1} of q_i, c_i =
// cos(2 pi i / n) for u and the sine for v, where a = a(2 pi / n) with
//   a(x) = 1 + cos x + sqrt((9 + cos x)(1 + cos x)), of the eigenvalue (a(x) + 4) / 16.
//
// Boundary and crease: 1/6 2/3 1/6. On a side of k quads tangent_u = p_0 - p_k; tangent_v is the
// left eigenvector that varies as sin(i pi / k) over the inner neighbours, a = a(pi / k), l its
// eigenvalue:
//   inner p_i  a s_i        q_i  s_i + s_{i+1}        s_i = sin(i pi / k), S their sum
//   itself     ((l - 1/2) r + s_1 (a + 4)/16) / ((l - 1) (l - 1/4)),    r = S (3 a + 4)/8
//   p_0, p_k   (l - 3/4) itself - r
// and p_0 + p_1 + q_0 - 3 p for k = 1, at the level that first holds the vertex: the mode across
// the side is p_0 + p_1 - 2 p there, which vanishes where the boundary runs straight on. For k > 4
// the mode sin(2 i pi / k) shrinks more slowly than tangent_u: there the surface has no tangent
// plane, as a Loop surface for k > 6 (loop_masks.h). OpenSubdiv's tangents differ for k other than
// 2: those go with a changed edge rule.
//
// Dart: the eigenvectors are found by iteration of the subdivision matrix, which converges for all
// valences. OpenSubdiv takes the smooth mask, which is another point than its own subdivision tends
// to.
//
// Corner: the vertex itself; sides as in crease_masks.h, where tangent_v has the weights above of
// the inner p_i and of q_i, less their sum of the vertex, and for k = 1 those of a boundary.
SharpLimitMask QuadLimit(const SharpRing& ring);

}  // namespace rilievo

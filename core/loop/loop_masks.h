// Loop's masks (Loop 1987; boundaries as in Hoppe et al. 1994 and Biermann et al. 2000).
#pragma once

namespace rilievo {

// Weight of each neighbour in the subdivision of an interior vertex of this valence, Loop 1987:
// beta(n) = (5/8 - (3/8 + cos(2 pi / n)/4)^2) / n.
double LoopBeta(int valence);

// Weight of each neighbour in the limit position of an interior vertex: 1 / (n + 3 / (8 beta)).
// The vertex itself weighs 1 - n times that.
double LoopLimitWeight(int valence);

// Boundary vertex: subdivision 1/8 3/4 1/8, limit 1/6 2/3 1/6; boundary edge 1/2 1/2.
// Interior edge: 3/8 3/8 1/8 1/8.

}  // namespace rilievo

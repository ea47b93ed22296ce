// The zero set of an implicit function as a triangle mesh: marching cubes with a computed table.
#pragma once

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/control/implicit/implicit_function.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// Faces point from negative to positive values. The leaf cells of all levels are visited; the
// surface ends where the coarsest grid ends. On a face of a cell whose corners alternate in sign
// the negative corners are kept apart, on both sides alike: the result has no cracks and no edge
// with more than two faces. A vertex may still join two fans (see SplitFans).
absl::StatusOr<ControlMesh> ExtractIsoSurface(const ImplicitFunction& function,
                                              const RunContext& context);

// Polygons of one cell configuration: bit c of the index is set where corner c = x + 2 y + 4 z is
// negative. Triples of cell edges, each an oriented triangle.
struct CellTriangles {
  int count = 0;
  int edges[12][3] = {};
};
const CellTriangles& TrianglesOfCell(int negative_corners);

// The two corners of each of the 12 cell edges; edges 0-3 run along x, 4-7 along y, 8-11 along z.
extern const int kCellEdgeCorners[12][2];

// Corners of the six cell faces, counter-clockwise seen from outside the cell.
extern const int kCellFaces[6][4];

}  // namespace rilievo

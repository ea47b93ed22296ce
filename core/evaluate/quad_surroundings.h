// The control points around a quad, on its own side of creases and boundaries.
#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <vector>

#include "core/evaluate/bicubic_patch.h"
#include "core/geometry/triangle_mesh.h"
#include "core/loop/quad_topology.h"
#include "core/loop/refinement.h"

namespace rilievo {

// A quad with its parameters: (s, t) is (0, 0) in corner `turn` of QuadOfFace(face), and grows to
// (1, 0), (1, 1) and (0, 1) counter-clockwise.
struct QuadPart {
  int face = 0, turn = 0;
};

// One level of a refinement and its control points. Keeps both by reference.
class QuadSurroundings {
 public:
  QuadSurroundings(const LoopRefinement& refinement, int level, const Eigen::Matrix3Xd& points)
      : topology_(refinement.levels[level]),
        quads_(refinement.quads.levels[level]),
        corners_(refinement.quads.corners),
        points_(points),
        rings_(topology_, refinement.quads, level),
        one_part_(topology_.face_count(), 0) {}

  // The control points of the bicubic patch that the quad is; none where a corner is irregular or
  // an edge beside it is semi-sharp. Regular corners are inner vertices of four edges without sharp
  // ones, vertices on a crease or boundary that has two quads on this side, and corner vertices
  // between two sharp edges of the quad. Beyond a sharp edge points are mirrored, a + a - b: with
  // these the regular rules give those of the crease.
  std::optional<QuadGrid> GridOf(const QuadPart& part) const;

  // Whether that corner is irregular once its semi-sharp edges are smooth, or a corner vertex,
  // whose normals are those of its masks.
  bool IsIrregular(const QuadPart& part, int corner) const;

  // What the limit surface does at a corner of the part: its position, and tangents on its side.
  struct Corner {
    Eigen::Vector3d position, tangent_u, tangent_v;
  };
  Corner LimitAt(const QuadPart& part, int corner) const;

  // The quad and all that touch it, a manifold; `part` becomes the same quad there. `face_place`:
  // one number for each face of the level, -1, and so again afterwards.
  ControlMesh CutOut(QuadPart* part, std::vector<int>* face_place) const;

 private:
  // The control points beyond a regular corner: opposite to the next corner of the quad, to the one
  // before, and to both.
  struct Beyond {
    Eigen::Vector3d back, below, diagonal;
  };

  std::array<int, 4> CornersOf(const QuadPart& part) const;
  // None at an irregular one. `ring`: of corner i, without semi-sharp edges.
  std::optional<Beyond> BeyondCorner(const std::array<int, 4>& corners, int i,
                                     const QuadRing& ring) const;

  const MeshTopology& topology_;
  const QuadLevel& quads_;
  const std::vector<int>& corners_;
  const Eigen::Matrix3Xd& points_;
  QuadRings rings_;
  std::vector<int> one_part_;  // of each face, the same number
};

// The quarter of a part that holds its corner `child`, on level 1 of a refinement whose level 0 has
// the part. (s, t) runs in the same direction.
QuadPart ChildOf(const LoopRefinement& refinement, const QuadPart& part, int child);

}  // namespace rilievo

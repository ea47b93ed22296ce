// The surface beside an irregular vertex: ever smaller regular triangles around a point.
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "core/evaluate/face_surroundings.h"
#include "core/evaluate/quartic_patch.h"

namespace rilievo {

// A face p, b, c of some level whose corners b and c are regular and whose corner p is not, be it
// inner, dart, crease, boundary or corner vertex; no edge is semi-sharp. Subdivision reproduces
// this shape: of its four children three are regular, the one at p is such a fan again.
//
// Points are relative to p, so they shrink as the fan does and derivatives lose no digits however
// small it is. Stam (1998) takes powers of the subdivision matrix by its eigenvectors; repeated
// subdivision gives the same and needs no tables of valences and creases.
class IrregularFan {
 public:
  // Of corner `corner` of the face.
  static IrregularFan At(const TaggedLevel& level, int face, int corner);

  // Where p is.
  const Eigen::Vector3d& origin() const { return origin_; }

  // The fan of the child at p.
  IrregularFan Smaller() const;

  // One of the three regular children: that at b (1), at c (2), or the middle one (3); their
  // corners are those of refinement.h with p as corner 0. Relative to origin().
  RegularRing Child(int child) const;

 private:
  // What stands on the next level around the midpoints of the face's edges.
  struct Finer {
    Eigen::Vector3d p, b, c, x;             // vertex p; midpoints of p b, of p c and of b c
    Eigen::Vector3d left, right;            // neighbours of p before b and after c
    Eigen::Vector3d at_b, at_c;             // vertices b and c
    Eigen::Vector3d on_b_left, on_c_right;  // midpoints of b left and of c right
  };
  Finer Refine() const;
  Eigen::Vector3d VertexPoint() const;
  Eigen::Vector3d SpokePoint(int i) const;

  int ring_size() const { return static_cast<int>(ring_.size()); }
  int Before(int i) const { return i > 0 ? i - 1 : ring_size() - 1; }
  int After(int i) const { return i + 1 < ring_size() ? i + 1 : 0; }
  const Eigen::Vector3d& b() const { return ring_[place_]; }
  const Eigen::Vector3d& c() const { return ring_[After(place_)]; }
  Eigen::Vector3d Left() const;   // beyond the edge p b, mirrored where that is sharp
  Eigen::Vector3d Right() const;  // beyond the edge p c
  bool LeftIsMirrored() const { return place_ == sharp_spoke_ || (!closed_ && place_ == 0); }
  bool RightIsMirrored() const {
    return After(place_) == sharp_spoke_ || (!closed_ && place_ + 2 == ring_size());
  }

  bool closed_ = false;
  VertexKind kind_ = VertexKind::kSmooth;
  int place_ = 0, sharp_spoke_ = -1;  // as in FaceStar
  double beta_ = 0;  // weight of a neighbour in the vertex rule where that is smooth
  Eigen::Vector3d origin_;
  std::vector<Eigen::Vector3d> ring_;
  // Around b after the left one, up to the one opposite the edge b c; then around c.
  Eigen::Vector3d b1_, b2_, x_, c1_, c2_;
};

}  // namespace rilievo

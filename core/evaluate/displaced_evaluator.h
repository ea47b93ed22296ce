// A displaced surface at any parameter.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/evaluate/limit_evaluator.h"
#include "core/evaluate/surface_jet.h"
#include "core/geometry/spatial_frame.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

// The format says where the vertices of the finest level are. Between them this surface is
//   S(u, v) = L(u, v) + sum of w_i(u, v) h_i n_i,
// L the limit surface, and w_i the barycentric coordinates of (u, v) in the triangle of the finest
// level that holds it, with h_i and n_i the heights and normals of its corners. So S passes through
// the vertices, is continuous everywhere (across a crease, too, where the normals of L are not),
// and has the second derivatives of L: the relief is linear within each finest triangle, and bends
// along its edges only. Tessellate() draws the flat triangles between the same vertices; they are
// farther from S by no more than L bends over one of them.
//
// At irregular vertices derivatives and normals are those of the flat triangle there.
class DisplacedEvaluator {
 public:
  // `surface` is not needed afterwards. Errors as DisplaceVertices() and LimitEvaluator::Build().
  static absl::StatusOr<DisplacedEvaluator> Build(const DisplacedSurface& surface,
                                                  const RunContext& context);
  // The same, of vertices that are there already.
  static absl::StatusOr<DisplacedEvaluator> Build(const DisplacedSurface& surface,
                                                  const Eigen::Matrix3Xd& displacements,
                                                  const RunContext& context);

  int face_count() const { return limit_.face_count(); }
  const SpatialFrame& frame() const { return frame_; }
  absl::Status Check(int64_t face, double u, double v) const { return limit_.Check(face, u, v); }

  // Scan frame, for what Check() accepts.
  SurfaceJet At(int face, double u, double v, JetOrder order) const;
  SurfaceJet LimitAt(int face, double u, double v, JetOrder order) const;

  // At() for many places: `jets[i]` for `places[i]`. It looks a few places ahead and waits less for
  // patches to come from memory, which is most of the time where faces are in no order.
  struct Parameter {
    int face = 0;
    double u = 0, v = 0;
  };
  void AtAll(std::span<const Parameter> places, JetOrder order, SurfaceJet* jets) const;

  // Unit frame.
  SurfaceJet UnitAt(int face, double u, double v, JetOrder order) const;

  // A triangle of the finest level on a control face, n of them along a side. Its corners are the
  // lattice points (i, j), (i + 1, j), (i, j + 1), or (i + 1, j + 1), (i, j + 1), (i + 1, j) where
  // it is turned; (i, j) lies at u = i / n, v = j / n.
  struct FinestTriangle {
    int face = 0, i = 0, j = 0;
    bool turned = false;
  };
  int triangles_along_side() const { return n_; }
  // The parameters on its face of the place with these weights of the second and third corner.
  Eigen::Vector2d ParametersOf(const FinestTriangle& at, const Eigen::Vector2d& weights) const;
  // The surface there, unit frame, with derivatives in these weights, also on the triangle's edges:
  // there those of its own side.
  SurfaceJet UnitAtTriangle(const FinestTriangle& at, const Eigen::Vector2d& weights,
                            JetOrder order) const;

 private:
  // Of a place: its triangle, and the weights of the second and third corner.
  FinestTriangle TriangleAt(int face, double u, double v, Eigen::Vector2d* weights) const;
  // What the place is displaced by, and along the sides from the first corner to the others.
  struct Displacement {
    Eigen::Vector3d here, to_second, to_third;
  };
  Displacement DisplacementAt(const FinestTriangle& at, const Eigen::Vector2d& weights) const;
  const Eigen::Vector3d& Stored(int face, int i, int j) const {
    const int place = j * (n_ + 1) - j * (j - 1) / 2 + i;
    return displacements_[static_cast<size_t>(face) * per_face_ + place];
  }
  // A place in the tables, and the jet there, unit frame.
  struct Found {
    PatchPlace patch;
    FinestTriangle triangle;
    Eigen::Vector2d weights;  // in the triangle
  };
  Found Find(int face, double u, double v) const;
  SurfaceJet UnitAtPlace(const Found& found, JetOrder order) const;
  void UseFlatTriangle(const FinestTriangle& at, SurfaceJet& jet) const;
  void ToScanFrame(JetOrder order, SurfaceJet& jet) const;

  LimitEvaluator limit_;
  SpatialFrame frame_;
  int n_ = 1;  // finest triangles along a side of a control face
  int per_face_ = 3;
  // Of the lattice points of each control face in rows of j (loop/patch_lattice.h).
  std::vector<Eigen::Vector3d> displacements_;
};

}  // namespace rilievo

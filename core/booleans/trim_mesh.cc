#include "core/booleans/trim_mesh.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <unordered_map>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/booleans/combine_solids.h"
#include "core/geometry/mesh_topology.h"

namespace rilievo {
namespace {

// Triangles that are split conformingly: an edge gets its vertex on both sides.
class TrimCutter {
 public:
  TrimCutter(const TriangleMesh& mesh, double diagonal, size_t most_added)
      : diagonal_(diagonal), most_added_(most_added) {
    points_.reserve(static_cast<size_t>(mesh.vertices.cols()));
    for (const auto& point : mesh.vertices.colwise()) points_.push_back(point);
    faces_.reserve(static_cast<size_t>(mesh.triangles.cols()));
    for (int f = 0; f < mesh.triangles.cols(); ++f) {
      faces_.push_back({{mesh.triangles(0, f), mesh.triangles(1, f), mesh.triangles(2, f)}, f});
    }
    cut_.assign(faces_.size(), 0);
  }

  absl::Status Cut(const TrimBounds& bounds, const RunContext& context) {
    if (bounds.outline.cols() > 0) return CutOutline(bounds, context);
    for (const TrimSide& side : bounds.sides) {
      if (side.radius > 0) RILIEVO_RETURN_IF_ERROR(RefineAlong(side, context));
      RILIEVO_RETURN_IF_ERROR(CutSide(side, context));
    }
    return absl::OkStatus();
  }

  TrimmedMesh Keep(KeptSide kept) const {
    TrimmedMesh trimmed;
    std::vector<int> number(points_.size(), -1);
    std::vector<int> used;
    std::vector<Eigen::Vector3i> triangles;
    for (const Face& face : faces_) {
      if (face.inside != (kept == KeptSide::kInside)) continue;
      Eigen::Vector3i corners;
      for (size_t k = 0; k < 3; ++k) {
        int& v = number[static_cast<size_t>(face.corners[k])];
        if (v < 0) {
          v = static_cast<int>(used.size());
          used.push_back(face.corners[k]);
        }
        corners[static_cast<Eigen::Index>(k)] = v;
      }
      triangles.push_back(corners);
    }
    trimmed.mesh.vertices.resize(3, static_cast<Eigen::Index>(used.size()));
    for (size_t i = 0; i < used.size(); ++i) {
      trimmed.mesh.vertices.col(static_cast<Eigen::Index>(i)) =
          points_[static_cast<size_t>(used[i])];
    }
    trimmed.mesh.triangles.resize(3, static_cast<Eigen::Index>(triangles.size()));
    for (size_t i = 0; i < triangles.size(); ++i) {
      trimmed.mesh.triangles.col(static_cast<Eigen::Index>(i)) = triangles[i];
    }
    trimmed.cut_faces = std::count(cut_.begin(), cut_.end(), 1);
    return trimmed;
  }

 private:
  struct Face {
    std::array<int, 3> corners;
    int source;          // triangle of the given mesh
    bool inside = true;  // of the sides so far
  };

  const Eigen::Vector3d& PointOf(const Face& face, size_t k) const {
    return points_[static_cast<size_t>(face.corners[k % 3])];
  }
  static uint64_t KeyOf(int a, int b) {
    const auto [low, high] = std::minmax(a, b);
    return static_cast<uint64_t>(low) << 32 | static_cast<uint32_t>(high);
  }
  // The vertex on an edge that is split, or -1.
  int OnEdge(const Face& face, size_t k) const {
    const auto found = on_edge_.find(KeyOf(face.corners[k], face.corners[(k + 1) % 3]));
    return found == on_edge_.end() ? -1 : found->second;
  }
  void SplitEdge(int a, int b, const Eigen::Vector3d& at) {
    if (on_edge_.try_emplace(KeyOf(a, b), static_cast<int>(points_.size())).second) {
      points_.push_back(at);
    }
  }

  // Splits all triangles that have a vertex in `on_edge_`, which is empty afterwards.
  absl::Status SplitFaces() {
    if (on_edge_.empty()) return absl::OkStatus();
    std::vector<uint8_t> touched(points_.size(), 0);
    for (const auto& [key, vertex] : on_edge_) {
      touched[key >> 32] = touched[key & 0xffffffffu] = 1;
    }
    const size_t count = faces_.size();
    for (size_t f = 0; f < count; ++f) {
      const auto& corners = faces_[f].corners;
      if (touched[static_cast<size_t>(corners[0])] + touched[static_cast<size_t>(corners[1])] +
              touched[static_cast<size_t>(corners[2])] >=
          2) {
        SplitFace(f);
      }
    }
    on_edge_.clear();
    if (faces_.size() <= cut_.size() + most_added_) return absl::OkStatus();
    return absl::FailedPreconditionError(
        absl::StrCat("trimming adds more than ", most_added_,
                     " triangles; take a shape that meets less of the mesh, or a coarser mesh"));
  }

  void SplitFace(size_t f) {
    const Face face = faces_[f];
    std::array<int, 3> middle;
    int splits = 0;
    for (size_t k = 0; k < 3; ++k) {
      middle[k] = OnEdge(face, k);
      splits += middle[k] >= 0 ? 1 : 0;
    }
    if (splits == 0) return;
    cut_[static_cast<size_t>(face.source)] = 1;
    auto put = [&, first = true](int a, int b, int c) mutable {
      if (first) {
        faces_[f].corners = {a, b, c};
      } else {
        faces_.push_back({{a, b, c}, face.source, face.inside});
      }
      first = false;
    };
    // Turned so that the edge from a to b is split and, of two, that from c to a.
    size_t k = 0;
    while (middle[k] < 0 || (splits == 2 && middle[(k + 2) % 3] < 0)) ++k;
    const int a = face.corners[k], b = face.corners[(k + 1) % 3], c = face.corners[(k + 2) % 3],
              ab = middle[k], bc = middle[(k + 1) % 3], ca = middle[(k + 2) % 3];
    if (splits == 1) {
      put(a, ab, c);
      put(ab, b, c);
      return;
    }
    put(a, ab, ca);
    if (splits == 3) {
      put(ab, b, bc);
      put(ca, bc, c);
      put(ab, bc, ca);
      return;
    }
    const auto length = [&](int u, int v) {
      return (points_[static_cast<size_t>(u)] - points_[static_cast<size_t>(v)]).squaredNorm();
    };
    if (length(ab, c) < length(b, ca)) {
      put(ab, b, c);
      put(ab, c, ca);
    } else {
      put(ab, b, ca);
      put(b, c, ca);
    }
  }

  // Halves edges of triangles near the sphere until they are short enough to follow it.
  absl::Status RefineAlong(const TrimSide& sphere, const RunContext& context) {
    const double longest = EdgeOnSphere(sphere.radius, diagonal_);
    for (bool more = true; more;) {
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      for (const Face& face : faces_) {
        if (!face.inside) continue;
        const Eigen::Vector3d middle = (PointOf(face, 0) + PointOf(face, 1) + PointOf(face, 2)) / 3;
        double reach = 0;
        for (size_t k = 0; k < 3; ++k) {
          reach = std::max(reach, (PointOf(face, k) - middle).squaredNorm());
        }
        if (std::abs(sphere.ValueAt(middle)) > std::sqrt(reach)) continue;
        for (size_t k = 0; k < 3; ++k) {
          const Eigen::Vector3d &p = PointOf(face, k), &q = PointOf(face, k + 1);
          if ((q - p).norm() > longest) {
            SplitEdge(face.corners[k], face.corners[(k + 1) % 3], (p + q) / 2);
          }
        }
      }
      more = !on_edge_.empty();
      RILIEVO_RETURN_IF_ERROR(SplitFaces());
    }
    return absl::OkStatus();
  }

  // Which side of it a point is on; 0: nearer than the tolerance.
  int8_t SignAt(const TrimSide& side, const Eigen::Vector3d& point) const {
    const double value = side.ValueAt(point);
    return std::abs(value) <= kTrimTolerance * diagonal_ ? 0 : value > 0 ? 1 : -1;
  }

  // Of what may be inside still, what is on the far side of `side` is outside.
  absl::Status CutSide(const TrimSide& side, const RunContext& context) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    std::vector<int8_t> sign(points_.size());
    for (size_t v = 0; v < points_.size(); ++v) {
      sign[v] = SignAt(side, points_[v]);
    }
    for (const Face& face : faces_) {
      if (!face.inside) continue;
      for (size_t k = 0; k < 3; ++k) {
        const auto [a, b] = std::minmax(face.corners[k], face.corners[(k + 1) % 3]);
        if (sign[static_cast<size_t>(a)] * sign[static_cast<size_t>(b)] >= 0) continue;
        SplitEdge(a, b,
                  side.Crossing(points_[static_cast<size_t>(a)], points_[static_cast<size_t>(b)]));
      }
    }
    RILIEVO_RETURN_IF_ERROR(SplitFaces());
    sign.resize(points_.size(), 0);
    for (Face& face : faces_) {
      if (!face.inside) continue;
      int above = 0, below = 0;
      for (const int v : face.corners) {
        above += sign[static_cast<size_t>(v)] > 0 ? 1 : 0;
        below += sign[static_cast<size_t>(v)] < 0 ? 1 : 0;
      }
      const Eigen::Vector3d middle = (PointOf(face, 0) + PointOf(face, 1) + PointOf(face, 2)) / 3;
      // A triangle within the side itself: by where its middle is.
      if (above > 0 || (below == 0 && side.ValueAt(middle) > 0)) face.inside = false;
    }
    return absl::OkStatus();
  }

  using FlatFace = std::array<Eigen::Vector2d, 3>;
  FlatFace Flat(const Face& face, const TrimBounds& bounds) const {
    return {bounds.to_outline * PointOf(face, 0), bounds.to_outline * PointOf(face, 1),
            bounds.to_outline * PointOf(face, 2)};
  }

  // Splits along each side the triangles that its part of the outline meets, and no others. After
  // that no triangle reaches over the outline.
  absl::Status CutOutline(const TrimBounds& bounds, const RunContext& context) {
    const Eigen::Index count = bounds.outline.cols();
    for (Eigen::Index i = 0; i < count; ++i) {
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      const TrimSide& side = bounds.sides[static_cast<size_t>(i)];
      for (const Face& face : faces_) {
        if (!MayMeet(Flat(face, bounds), bounds.outline.col(i),
                     bounds.outline.col((i + 1) % count))) {
          continue;
        }
        for (size_t k = 0; k < 3; ++k) {
          const auto [a, b] = std::minmax(face.corners[k], face.corners[(k + 1) % 3]);
          const Eigen::Vector3d &p = points_[static_cast<size_t>(a)],
                                &q = points_[static_cast<size_t>(b)];
          if (SignAt(side, p) * SignAt(side, q) < 0) SplitEdge(a, b, side.Crossing(p, q));
        }
      }
      RILIEVO_RETURN_IF_ERROR(SplitFaces());
    }
    const Eigen::Vector2d low = bounds.outline.rowwise().minCoeff(),
                          high = bounds.outline.rowwise().maxCoeff();
    for (size_t f = 0; f < faces_.size(); ++f) {
      if (f % 4096 == 0) RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      const FlatFace flat = Flat(faces_[f], bounds);
      const Eigen::Vector2d middle = (flat[0] + flat[1] + flat[2]) / 3;
      faces_[f].inside = (middle.array() >= low.array()).all() &&
                         (middle.array() <= high.array()).all() && InOutline(bounds, middle);
    }
    return absl::OkStatus();
  }

  // Whether a triangle and a segment come as near as the tolerance, by their shadows on the axes
  // and across all edges.
  bool MayMeet(const FlatFace& face, const Eigen::Vector2d& from, const Eigen::Vector2d& to) const {
    const double near = kTrimTolerance * diagonal_;
    const auto apart = [&](const Eigen::Vector2d& across, double margin) {
      const double a = across.dot(face[0]), b = across.dot(face[1]), c = across.dot(face[2]);
      const double d = across.dot(from), e = across.dot(to);
      return std::min({a, b, c}) > std::max(d, e) + margin ||
             std::max({a, b, c}) < std::min(d, e) - margin;
    };
    if (apart(Eigen::Vector2d::UnitX(), near) || apart(Eigen::Vector2d::UnitY(), near)) {
      return false;
    }
    for (size_t k = 0; k < 3; ++k) {
      const Eigen::Vector2d edge = face[(k + 1) % 3] - face[k];
      if (apart({-edge.y(), edge.x()}, near * edge.norm())) return false;
    }
    return true;
  }

  // By the number of sides to the right of a point.
  static bool InOutline(const TrimBounds& bounds, const Eigen::Vector2d& point) {
    bool inside = false;
    for (Eigen::Index i = 0, j = bounds.outline.cols() - 1; i < bounds.outline.cols(); j = i++) {
      const Eigen::Vector2d a = bounds.outline.col(i), b = bounds.outline.col(j);
      if ((a.y() > point.y()) == (b.y() > point.y())) continue;
      if (point.x() < a.x() + (point.y() - a.y()) / (b.y() - a.y()) * (b.x() - a.x())) {
        inside = !inside;
      }
    }
    return inside;
  }

  double diagonal_;
  size_t most_added_;  // triangles beyond those of the mesh
  std::vector<Eigen::Vector3d> points_;
  std::vector<Face> faces_;
  std::vector<uint8_t> cut_;                   // by given triangle: 1 where it was split
  std::unordered_map<uint64_t, int> on_edge_;  // vertices on edges that are split next
};

absl::Status CheckTrimmed(const TriangleMesh& mesh) {
  if (mesh.triangles.cols() == 0) return absl::InvalidArgumentError("the mesh has no triangles");
  if (mesh.vertices.allFinite()) return absl::OkStatus();
  return absl::InvalidArgumentError("the mesh has coordinates that are not finite");
}

}  // namespace

absl::StatusOr<TrimmedMesh> TrimMesh(const TriangleMesh& mesh, const TrimShape& shape,
                                     KeptSide kept, const RunContext& context, size_t most_added) {
  RILIEVO_RETURN_IF_ERROR(CheckTrimmed(mesh));
  RILIEVO_ASSIGN_OR_RETURN(const TrimBounds bounds, BoundsOf(shape));
  const Eigen::Vector3d size =
      mesh.vertices.rowwise().maxCoeff() - mesh.vertices.rowwise().minCoeff();
  TrimCutter cutter(mesh, size.norm(), most_added);
  RILIEVO_RETURN_IF_ERROR(cutter.Cut(bounds, context));
  TrimmedMesh trimmed = cutter.Keep(kept);
  if (trimmed.mesh.triangles.cols() > 0) return trimmed;
  return absl::FailedPreconditionError(
      absl::StrCat("nothing is left: all of the mesh lies ",
                   kept == KeptSide::kInside ? "outside" : "inside", " of the shape"));
}

absl::StatusOr<TrimmedMesh> TrimSolid(const TriangleMesh& mesh, const TrimShape& shape,
                                      KeptSide kept, const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(CheckTrimmed(mesh));
  const int64_t open =
      SummarizeTopology(mesh.triangles, static_cast<int>(mesh.vertices.cols())).boundary_edges;
  if (open > 0) {
    return absl::FailedPreconditionError(absl::StrCat(
        "the mesh is open: ", open,
        " of its edges have a triangle on one side only; trim it without a cap, or close it "
        "first (reconstruct with --boundary close)"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const TriangleMesh solid, SolidOfShape(shape, mesh));
  RILIEVO_ASSIGN_OR_RETURN(CombinedSolids made,
                           CombineSolids(mesh, solid,
                                         kept == KeptSide::kInside ? SolidOperation::kIntersection
                                                                   : SolidOperation::kDifference,
                                         context));
  return TrimmedMesh{std::move(made.mesh), made.cut_faces};
}

}  // namespace rilievo

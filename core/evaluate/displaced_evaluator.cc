#include "core/evaluate/displaced_evaluator.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/face_vertices.h"

namespace rilievo {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

// Places that are looked for before the first of them is evaluated: while its patch comes from
// memory, the others are found.
constexpr size_t kLookAhead = 4;

}  // namespace

absl::StatusOr<DisplacedEvaluator> DisplacedEvaluator::Build(const DisplacedSurface& surface,
                                                             const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const DisplacedVertices vertices, DisplaceVertices(surface, context));
  return Build(surface, vertices.displacements, context);
}

absl::StatusOr<DisplacedEvaluator> DisplacedEvaluator::Build(const DisplacedSurface& surface,
                                                             const Eigen::Matrix3Xd& displacements,
                                                             const RunContext& context) {
  DisplacedEvaluator made;
  RILIEVO_ASSIGN_OR_RETURN(made.limit_, LimitEvaluator::Build(surface.control_mesh, context));
  made.frame_ = surface.frame;
  made.n_ = 1 << surface.max_level;
  made.per_face_ = (made.n_ + 1) * (made.n_ + 2) / 2;
  RILIEVO_ASSIGN_OR_RETURN(
      const MeshTopology control,
      BuildMeshTopology(surface.control_mesh.faces,
                        static_cast<int>(surface.control_mesh.vertices.cols())));
  const FaceVertices vertices_of(control, surface.max_level);
  made.displacements_.resize(static_cast<size_t>(control.face_count()) * made.per_face_);
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(control.face_count(), kHeavyBlock, context, [&](int64_t begin, int64_t end) {
        std::vector<int> vertices;
        for (int64_t f = begin; f < end; ++f) {
          vertices_of.Of(static_cast<int>(f), vertices);
          for (int i = 0; i < made.per_face_; ++i) {
            made.displacements_[static_cast<size_t>(f) * made.per_face_ + i] =
                displacements.col(vertices[i]);
          }
        }
      }));
  return made;
}

DisplacedEvaluator::FinestTriangle DisplacedEvaluator::TriangleAt(int face, double u, double v,
                                                                  Vector2d* weights) const {
  const double x = std::clamp(u, 0.0, 1.0) * n_, y = std::clamp(v, 0.0, 1.0) * n_;
  FinestTriangle at;
  at.face = face;
  at.i = std::min(static_cast<int>(x), n_ - 1);
  at.j = std::min(static_cast<int>(y), n_ - 1 - at.i);
  *weights = {x - at.i, y - at.j};
  at.turned = weights->sum() > 1 && at.i + at.j + 1 < n_;
  if (at.turned) *weights = Vector2d(1, 1) - *weights;
  return at;
}

Vector2d DisplacedEvaluator::ParametersOf(const FinestTriangle& at, const Vector2d& weights) const {
  const Vector2d first(at.i + at.turned, at.j + at.turned);
  return (at.turned ? Vector2d(first - weights) : Vector2d(first + weights)) / n_;
}

DisplacedEvaluator::Displacement DisplacedEvaluator::DisplacementAt(const FinestTriangle& at,
                                                                    const Vector2d& weights) const {
  const int far = at.turned;
  const Vector3d& first = Stored(at.face, at.i + far, at.j + far);
  Displacement displacement;
  displacement.to_second = Stored(at.face, at.i + 1 - far, at.j + far) - first;
  displacement.to_third = Stored(at.face, at.i + far, at.j + 1 - far) - first;
  displacement.here =
      first + weights[0] * displacement.to_second + weights[1] * displacement.to_third;
  return displacement;
}

DisplacedEvaluator::Found DisplacedEvaluator::Find(int face, double u, double v) const {
  Found found;
  found.patch = limit_.Find(face, u, v);
  found.triangle = TriangleAt(face, u, v, &found.weights);
  const FinestTriangle& at = found.triangle;
  PrefetchPart(Stored(at.face, at.i + 1, at.j));
  PrefetchPart(Stored(at.face, at.i, at.j + 1));
  return found;
}

SurfaceJet DisplacedEvaluator::UnitAt(int face, double u, double v, JetOrder order) const {
  return UnitAtPlace(Find(face, u, v), order);
}

SurfaceJet DisplacedEvaluator::UnitAtPlace(const Found& found, JetOrder order) const {
  SurfaceJet jet = limit_.AtPlace(found.patch, order);
  const FinestTriangle& at = found.triangle;
  const Displacement displacement = DisplacementAt(at, found.weights);
  jet.position += displacement.here;
  if (order == JetOrder::kPosition) return jet;
  if (jet.irregular) {
    UseFlatTriangle(at, jet);
    return jet;
  }
  const double scale = at.turned ? -n_ : n_;
  jet.u += scale * displacement.to_second;
  jet.v += scale * displacement.to_third;
  return jet;
}

SurfaceJet DisplacedEvaluator::UnitAtTriangle(const FinestTriangle& at, const Vector2d& weights,
                                              JetOrder order) const {
  const Vector2d parameters = ParametersOf(at, weights);
  SurfaceJet jet = limit_.At(at.face, parameters[0], parameters[1], order);
  const Displacement displacement = DisplacementAt(at, weights);
  jet.position += displacement.here;
  if (order == JetOrder::kPosition || jet.irregular) return jet;
  const double scale = (at.turned ? -1.0 : 1.0) / n_;
  jet.u = scale * jet.u + displacement.to_second;
  jet.v = scale * jet.v + displacement.to_third;
  jet.uu *= scale * scale;
  jet.uv *= scale * scale;
  jet.vv *= scale * scale;
  return jet;
}

// A triangle in a corner of the face is not turned.
void DisplacedEvaluator::UseFlatTriangle(const FinestTriangle& at, SurfaceJet& jet) const {
  const auto point = [&](double second, double third) {
    return UnitAtTriangle(at, {second, third}, JetOrder::kPosition).position;
  };
  const Vector3d first = point(0, 0);
  jet.u = n_ * (point(1, 0) - first);
  jet.v = n_ * (point(0, 1) - first);
}

void DisplacedEvaluator::ToScanFrame(JetOrder order, SurfaceJet& jet) const {
  jet.position = frame_.ScanFromUnit(jet.position);
  if (order >= JetOrder::kFirst) {
    jet.u *= frame_.diagonal;
    jet.v *= frame_.diagonal;
  }
  if (order >= JetOrder::kSecond) {
    jet.uu *= frame_.diagonal;
    jet.uv *= frame_.diagonal;
    jet.vv *= frame_.diagonal;
  }
}

SurfaceJet DisplacedEvaluator::At(int face, double u, double v, JetOrder order) const {
  SurfaceJet jet = UnitAt(face, u, v, order);
  ToScanFrame(order, jet);
  return jet;
}

void DisplacedEvaluator::AtAll(std::span<const Parameter> places, JetOrder order,
                               SurfaceJet* jets) const {
  std::array<Found, kLookAhead> ahead;
  const size_t count = places.size();
  for (size_t i = 0; i < count + kLookAhead; ++i) {
    Found& found = ahead[i % kLookAhead];
    if (i >= kLookAhead) {
      SurfaceJet& jet = jets[i - kLookAhead];
      jet = UnitAtPlace(found, order);
      ToScanFrame(order, jet);
    }
    if (i < count) found = Find(places[i].face, places[i].u, places[i].v);
  }
}

SurfaceJet DisplacedEvaluator::LimitAt(int face, double u, double v, JetOrder order) const {
  SurfaceJet jet = limit_.At(face, u, v, order);
  ToScanFrame(order, jet);
  return jet;
}

}  // namespace rilievo

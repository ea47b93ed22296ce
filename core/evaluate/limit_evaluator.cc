#include "core/evaluate/limit_evaluator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

// Nearer to an irregular vertex than this the surface is taken at the vertex: what separates them
// is less than the smallest double of a unit frame.
constexpr double kAtVertex = 0x1p-200;

// The child of a face that holds (u, v), and where there: corner 0, 1, 2, the middle one. Returns
// the child; the middle one's parameters run backwards.
int Descend(double& u, double& v) {
  if (u + v <= 0.5) {
    u *= 2;
    v *= 2;
    return 0;
  }
  if (u >= 0.5) {
    u = 2 * u - 1;
    v *= 2;
    return 1;
  }
  if (v >= 0.5) {
    u *= 2;
    v = 2 * v - 1;
    return 2;
  }
  u = 1 - 2 * u;
  v = 1 - 2 * v;
  return 3;
}

// What the chain rule makes of a jet whose parameters grow `scale` times as fast.
void Scale(double scale, JetOrder order, SurfaceJet& jet) {
  if (order >= JetOrder::kFirst) {
    jet.u *= scale;
    jet.v *= scale;
  }
  if (order >= JetOrder::kSecond) {
    const double square = scale * scale;
    jet.uu *= square;
    jet.uv *= square;
    jet.vv *= square;
  }
}

// From the parameters (b, c) with corner `corner` in the place of corner 0 to (u, v).
void Turn(int corner, JetOrder order, SurfaceJet& jet) {
  const SurfaceJet by = jet;
  if (corner == 1) {  // b = v, c = 1 - u - v
    jet.u = -by.v;
    jet.v = by.u - by.v;
    if (order < JetOrder::kSecond) return;
    jet.uu = by.vv;
    jet.uv = by.vv - by.uv;
    jet.vv = by.uu - 2 * by.uv + by.vv;
  } else if (corner == 2) {  // b = 1 - u - v, c = u
    jet.u = by.v - by.u;
    jet.v = -by.u;
    if (order < JetOrder::kSecond) return;
    jet.uu = by.uu - 2 * by.uv + by.vv;
    jet.uv = by.uu - by.uv;
    jet.vv = by.uu;
  }
}

}  // namespace

absl::Status LimitEvaluator::Check(int64_t face, double u, double v) const {
  if (face < 0 || face >= face_count()) {
    return absl::InvalidArgumentError(
        absl::StrCat("face is ", face, ", this surface has control faces 0 to ", face_count() - 1));
  }
  const bool inside =
      u >= -kParameterSlack && v >= -kParameterSlack && u + v <= 1 + kParameterSlack;
  if (inside) return absl::OkStatus();
  return absl::InvalidArgumentError(absl::StrCat(
      "u is ", u, " and v is ", v, "; both must be at least 0 and their sum at most 1"));
}

PatchPlace LimitEvaluator::Find(int face, double u, double v) const {
  if (quads_) return quads_->Find(face, u, v);
  u = std::clamp(u, 0.0, 1.0);
  v = std::clamp(v, 0.0, 1.0 - u);
  PatchPlace place = {face, roots_[face], u, v};
  while (place.code >= 0) {
    const int child = Descend(place.u, place.v);
    place.scale *= child == 3 ? -2 : 2;
    place.code = nodes_[place.code][child];
  }
  const size_t leaf = static_cast<size_t>(~place.code);
  if (leaf % 2 == 0) {
    PrefetchPart(patches_[leaf / 2]);
  } else {
    PrefetchPart(fans_[leaf / 2]);
  }
  return place;
}

SurfaceJet LimitEvaluator::AtPlace(const PatchPlace& place, JetOrder order) const {
  if (quads_) return quads_->AtPlace(place, order);
  const size_t leaf = static_cast<size_t>(~place.code);
  SurfaceJet jet;
  if (leaf % 2 == 0) {
    patches_[leaf / 2].Evaluate(place.u, place.v, order, jet);
  } else {
    jet = AtTurnedFan(fans_[leaf / 2], place.u, place.v, order);
    if (jet.irregular) return jet;
  }
  Scale(place.scale, order, jet);
  return jet;
}

SurfaceJet LimitEvaluator::AtTurnedFan(const Fan& fan, double u, double v, JetOrder order) const {
  const double weights[3] = {1 - u - v, u, v};
  SurfaceJet jet = AtFan(fan, weights[(fan.corner + 1) % 3], weights[(fan.corner + 2) % 3], order);
  if (!jet.irregular && order >= JetOrder::kFirst) Turn(fan.corner, order, jet);
  return jet;
}

SurfaceJet LimitEvaluator::AtFan(const Fan& fan, double b, double c, JetOrder order) const {
  SurfaceJet jet;
  b = std::max(b, 0.0);
  c = std::max(c, 0.0);
  if (b + c < kAtVertex) {
    jet.irregular = true;
    jet.position = fan.limit;
    jet.u = fan.tangent_u;
    jet.v = fan.tangent_v;
    jet.uu.setConstant(std::numeric_limits<double>::quiet_NaN());
    jet.uv = jet.vv = jet.uu;
    return jet;
  }
  double scale = 1;
  const auto descend = [&] {
    const int child = Descend(b, c);
    scale *= child == 3 ? -2 : 2;
    return child;
  };
  const auto finish = [&](const IrregularFan& last, int child) {
    QuarticPatch::Over(last.Child(child)).Evaluate(b, c, order, jet);
    jet.position += last.origin();
    Scale(scale, order, jet);
    return jet;
  };
  int child = descend();
  if (child != 0) return finish(fan.fan, child);
  IrregularFan smaller = fan.fan.Smaller();
  while ((child = descend()) == 0) smaller = smaller.Smaller();
  return finish(smaller, child);
}

}  // namespace rilievo

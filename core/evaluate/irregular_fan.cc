#include "core/evaluate/irregular_fan.h"

#include <utility>

#include "core/loop/loop_masks.h"

namespace rilievo {

using Eigen::Vector3d;

namespace {

// The rules of regular vertices and of edges (loop_masks.h).
Vector3d EdgeRule(const Vector3d& from, const Vector3d& to, const Vector3d& one,
                  const Vector3d& other) {
  return 0.375 * (from + to) + 0.125 * (one + other);
}

Vector3d RegularRule(const Vector3d& center, const std::array<const Vector3d*, 6>& around) {
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d* point : around) sum += *point;
  return 0.625 * center + 0.0625 * sum;
}

}  // namespace

IrregularFan IrregularFan::At(const TaggedLevel& level, int face, int corner) {
  const int vertex = level.topology.faces(corner, face);
  const FaceStar star = StarOf(level, face, corner);
  IrregularFan fan;
  fan.closed_ = star.closed;
  fan.kind_ = level.kinds[vertex];
  fan.place_ = star.place;
  fan.sharp_spoke_ = star.sharp_spoke;
  if (fan.kind_ < VertexKind::kCrease) fan.beta_ = LoopBeta(static_cast<int>(star.ring.size()));
  fan.origin_ = level.points.col(vertex);
  for (int v : star.ring) fan.ring_.push_back(level.points.col(v) - fan.origin_);
  const auto around_b = RegularStar(level, face, (corner + 1) % 3);
  const auto around_c = RegularStar(level, face, (corner + 2) % 3);
  fan.b1_ = around_b[3] - fan.origin_;
  fan.b2_ = around_b[4] - fan.origin_;
  fan.x_ = around_b[5] - fan.origin_;
  fan.c1_ = around_c[3] - fan.origin_;
  fan.c2_ = around_c[4] - fan.origin_;
  return fan;
}

Vector3d IrregularFan::Left() const {
  return LeftIsMirrored() ? Vector3d(b() - c()) : ring_[Before(place_)];
}

Vector3d IrregularFan::Right() const {
  return RightIsMirrored() ? Vector3d(c() - b()) : ring_[After(After(place_))];
}

Vector3d IrregularFan::VertexPoint() const {
  if (kind_ == VertexKind::kCorner) return Vector3d::Zero();
  if (kind_ == VertexKind::kCrease) return 0.125 * (ring_.front() + ring_.back());
  Vector3d sum = Vector3d::Zero();
  for (const Vector3d& point : ring_) sum += point;
  return beta_ * sum;
}

Vector3d IrregularFan::SpokePoint(int i) const {
  const bool sharp = i == sharp_spoke_ || (!closed_ && (i == 0 || i + 1 == ring_size()));
  if (sharp) return 0.5 * ring_[i];
  return 0.375 * ring_[i] + 0.125 * (ring_[Before(i)] + ring_[After(i)]);
}

IrregularFan::Finer IrregularFan::Refine() const {
  const Vector3d p = Vector3d::Zero(), left = Left(), right = Right();
  Finer finer;
  finer.p = VertexPoint();
  finer.b = SpokePoint(place_);
  finer.c = SpokePoint(After(place_));
  finer.x = EdgeRule(b(), c(), p, x_);
  finer.left =
      LeftIsMirrored() ? Vector3d(finer.p + finer.b - finer.c) : SpokePoint(Before(place_));
  finer.right =
      RightIsMirrored() ? Vector3d(finer.p + finer.c - finer.b) : SpokePoint(After(After(place_)));
  finer.at_b = RegularRule(b(), {&c(), &p, &left, &b1_, &b2_, &x_});
  finer.at_c = RegularRule(c(), {&p, &b(), &x_, &c1_, &c2_, &right});
  finer.on_b_left = EdgeRule(b(), left, p, b1_);
  finer.on_c_right = EdgeRule(c(), right, p, c2_);
  return finer;
}

IrregularFan IrregularFan::Smaller() const {
  const Finer finer = Refine();
  IrregularFan fan;
  fan.closed_ = closed_;
  fan.kind_ = kind_;
  fan.place_ = place_;
  fan.sharp_spoke_ = sharp_spoke_;
  fan.beta_ = beta_;
  fan.origin_ = origin_ + finer.p;
  fan.ring_.resize(ring_.size());
  for (int i = 0; i < ring_size(); ++i) fan.ring_[i] = SpokePoint(i) - finer.p;
  fan.b1_ = finer.on_b_left - finer.p;
  fan.b2_ = finer.at_b - finer.p;
  fan.x_ = finer.x - finer.p;
  fan.c1_ = finer.at_c - finer.p;
  fan.c2_ = finer.on_c_right - finer.p;
  return fan;
}

RegularRing IrregularFan::Child(int child) const {
  const Finer f = Refine();
  const Vector3d left = Left(), right = Right();
  const Vector3d bx = EdgeRule(b(), x_, b2_, c()), cx = EdgeRule(c(), x_, b(), c1_);
  if (child == 1) {
    const Vector3d bb1 = EdgeRule(b(), b1_, left, b2_), bb2 = EdgeRule(b(), b2_, b1_, x_);
    return {f.b, f.at_b, f.x, f.p, f.left, f.on_b_left, bb1, bb2, bx, cx, f.at_c, f.c};
  }
  if (child == 2) {
    const Vector3d cc1 = EdgeRule(c(), c1_, x_, c2_), cc2 = EdgeRule(c(), c2_, c1_, right);
    return {f.c, f.x, f.at_c, f.right, f.p, f.b, f.at_b, bx, cx, cc1, cc2, f.on_c_right};
  }
  return {f.x, f.c, f.b, bx, cx, f.at_c, f.on_c_right, f.right, f.p, f.left, f.on_b_left, f.at_b};
}

}  // namespace rilievo

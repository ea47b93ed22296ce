#include "core/displacement/local_fit/local_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "core/base/ablation.h"
#include "core/base/wide_registers.h"
#include "core/displacement/local_fit/fit_sums.h"
#include "core/displacement/local_fit/normal_equations.h"
#include "core/displacement/local_fit/project_patch.h"

namespace rilievo {
namespace {

using Lanes = Eigen::Array4f;
constexpr int kLaneCount = 4;

constexpr int kPlaneCount = 2;  // of the sizes, the first
static_assert(!kWindowSizes[kPlaneCount - 1].quadric && kWindowSizes[kPlaneCount].quadric);
// Points farther off a window's fit than this many noises are dropped.
constexpr float kOutlierNoises = 3.5f;
// The share of the plain variance that remains with weights 1 - r^2 (which are not their square),
// by simulation with uniform points.
constexpr float kPlaneVariance = 0.65f, kQuadricVariance = 0.8f;
// Of another sheet, or of none, may be points farther off in height.
constexpr float kSheetNoises = 5.0f;
constexpr float kSheetSpacings = 0.5f;

// An edge: points within this many spacings of the ray whose normals turn from the foot's by more
// than 53 degrees, at least so many and such a share of all there.
constexpr float kEdgeSpacings = 2.0f;
constexpr float kEdgeCosine = 0.6f;
constexpr float kLeastConcord = 0.6f;  // length of the mean of their normals
constexpr float kLeastEdgePoints = 4;
constexpr float kLeastEdgeShare = 0.2f;
// The edge is taken for one if its squared residuals are below this share of either side's.
constexpr float kEdgeCostShare = 0.5f;

// A fit farther than this off the height it started from extrapolates.
constexpr float kFarthestSpacings = 1.0f;
constexpr float kFarthestNoises = 3.0f;

// Comparisons of lanes, which Eigen makes one by one: all bits of a lane that passes.
using RawLanes = float __attribute__((vector_size(kLaneCount * sizeof(float))));
using LaneMask = int __attribute__((vector_size(kLaneCount * sizeof(int))));

RawLanes Raw(const Lanes& lanes) {
  RawLanes raw;
  std::memcpy(&raw, lanes.data(), sizeof(raw));
  return raw;
}

LaneMask AtMost(const Lanes& a, const Lanes& b) { return Raw(a) <= Raw(b); }

// The values of the lanes that pass, 0 in the others.
Lanes Where(LaneMask mask, const Lanes& values) {
  const RawLanes raw = Raw(values);
  LaneMask bits;
  std::memcpy(&bits, &raw, sizeof(bits));
  bits &= mask;
  Lanes kept;
  std::memcpy(kept.data(), &bits, sizeof(bits));
  return kept;
}

// All that the kernels read of `count` points.
static_assert(kWideLanes % kLaneCount == 0);
int Padded(int count) { return (count + kWideLanes - 1) / kWideLanes * kWideLanes; }

Lanes At(const std::vector<float>& values, int i) {
  return Eigen::Map<const Lanes>(values.data() + i);
}

Eigen::Map<Lanes> Put(std::vector<float>* values, int i) {
  return Eigen::Map<Lanes>(values->data() + i);
}

template <int kTerms>
void Basis(const Lanes& u, const Lanes& v, Lanes* basis) {
  basis[0] = Lanes::Ones();
  basis[1] = u;
  basis[2] = v;
  if constexpr (kTerms == 6) {
    basis[3] = u * u;
    basis[4] = u * v;
    basis[5] = v * v;
  }
}

}  // namespace

void LocalFitter::SetPatch(std::span<const QueuedPoint> points, const RayCloud& cloud) {
  patch_size_ = static_cast<int>(points.size());
  for (std::vector<float>& component : patch_) {
    component.assign(patch_size_ + kWideLanes, 0.0f);
  }
  for (int i = 0; i < patch_size_; ++i) {
    const RayPoint& point = cloud.points[points[i].point];
    for (int axis = 0; axis < 3; ++axis) {
      patch_[axis][i] = point.position[axis];
      patch_[3 + axis][i] = point.normal[axis];
    }
  }
  const int padded = Padded(patch_size_);
  std::vector<float>* const scratch[] = {&far_u_,      &far_v_,      &far_height_, &far_weight_,
                                         &far_square_, &u_,          &v_,          &height_,
                                         &weight_,     &kept_weight_};
  for (std::vector<float>* array : scratch) array->resize(padded + kWideLanes);
  far_window_.resize(padded + kWideLanes);
  inside_.resize(kWindowCount);
}

void LocalFitter::Project(const Ray& ray, const LocalFitRequest& request) {
  PatchView view;
  for (int axis = 0; axis < 3; ++axis) {
    view.origin[axis] = ray.origin[axis];
    view.u[axis] = ray.u[axis];
    view.v[axis] = ray.v[axis];
    view.direction[axis] = ray.direction[axis];
    view.foot_normal[axis] = request.foot_normal[axis];
  }
  view.height = request.height;
  view.scale = 1.0f / request.spacing;
  view.sheet = kSheetNoises * request.noise * view.scale + kSheetSpacings;
  ProjectPatch({{patch_[0].data(), patch_[1].data(), patch_[2].data()},
                {patch_[3].data(), patch_[4].data(), patch_[5].data()},
                patch_size_},
               view,
               {far_u_.data(), far_v_.data(), far_height_.data(), far_square_.data(),
                far_weight_.data(), far_window_.data()},
               inside_.data());
  // Sorted by the narrowest window that holds each point.
  std::array<int, kWindowCount> next;
  for (int w = 0; w < kWindowCount; ++w) next[w] = w > 0 ? inside_[w - 1] : 0;
  for (int i = 0; i < patch_size_; ++i) {
    const int w = far_window_[i];
    if (w == kWindowCount) continue;
    const int place = next[w]++;
    u_[place] = far_u_[i];
    v_[place] = far_v_[i];
    height_[place] = far_height_[i];
    weight_[place] = far_weight_[i];
  }
  for (int i = inside_.back(); i < inside_.back() + kWideLanes; ++i) {
    u_[i] = v_[i] = height_[i] = weight_[i] = kept_weight_[i] = 0;
  }
}

// Clears the weights of points farther than `most` off the fit; false when there are none.
template <int kTerms>
bool LocalFitter::DropOutliers(float scale, int inside, float most,
                               const Eigen::Matrix<double, kTerms, 1>& fit) {
  Lanes coefficients[kTerms], basis[kTerms];
  for (int a = 0; a < kTerms; ++a) coefficients[a] = Lanes::Constant(static_cast<float>(fit[a]));
  LaneMask dropped = {};
  for (int i = 0; i < Padded(inside); i += kLaneCount) {
    Basis<kTerms>(At(u_, i) * scale, At(v_, i) * scale, basis);
    Lanes residual = At(height_, i);
    for (int a = 0; a < kTerms; ++a) residual -= coefficients[a] * basis[a];
    const Lanes weight = At(weight_, i);
    const Lanes kept = Where(AtMost(residual.abs(), Lanes::Constant(most)), weight);
    Put(&kept_weight_, i) = kept;
    dropped |= Raw(kept) != Raw(weight);
  }
  int any = 0;
  for (int lane = 0; lane < kLaneCount; ++lane) any |= dropped[lane];
  return any != 0;
}

template <int kTerms>
bool LocalFitter::Accumulate(float scale, int inside, const std::vector<float>& weights,
                             NormalEquations<kTerms>* equations) const {
  const FitPoints points = {u_.data(), v_.data(), height_.data(), weights.data(), inside, scale};
  const FitSums sums = kTerms == 6 ? SumForQuadric(points) : SumForPlane(points);
  for (int a = 0; a < kTerms; ++a) {
    equations->solution[a] = sums.heights[a];
    for (int b = 0; b <= a; ++b) {
      equations->matrix(a, b) = sums.monomials[MonomialOfProduct(a, b)];
    }
  }
  // Half the points of a full plane window, weighed by the kernel's mean of 1/2.
  return equations->matrix(0, 0) > 0.5 * kTerms && equations->Solve();
}

template <int kTerms>
std::optional<FitWindow> LocalFitter::Fit(float radius, int inside, float outlier_distance) {
  const float scale = 1.0f / radius;
  NormalEquations<kTerms> equations;
  if (!Accumulate<kTerms>(scale, inside, weight_, &equations)) return std::nullopt;
  if (DropOutliers<kTerms>(scale, inside, outlier_distance, equations.solution)) {
    NormalEquations<kTerms> again;
    if (Accumulate<kTerms>(scale, inside, kept_weight_, &again)) equations = again;
  }
  return FitWindow{static_cast<float>(equations.solution[0]),
                   static_cast<float>(equations.solution[1]) * scale,
                   static_cast<float>(equations.solution[2]) * scale,
                   static_cast<float>(equations.inverse_first) *
                       (kTerms == 6 ? kQuadricVariance : kPlaneVariance)};
}

std::optional<LocalFitter::OtherSide> LocalFitter::FindOtherSide(
    const LocalFitRequest& request) const {
  if (IsLeftOut(Mechanism::kOtherSide)) return std::nullopt;
  const float reach = kEdgeSpacings + kSheetNoises * request.noise / request.spacing;
  Eigen::Vector3f normals[2], centers[2];
  float counts[2] = {0, 0};
  for (int side = 0; side < 2; ++side) {
    normals[side].setZero();
    centers[side].setZero();
  }
  for (int i = 0; i < patch_size_; ++i) {
    if (far_square_[i] > kEdgeSpacings * kEdgeSpacings) continue;
    if (std::abs(far_height_[i]) > reach) continue;
    const Eigen::Vector3f normal(patch_[3][i], patch_[4][i], patch_[5][i]);
    const int side = normal.dot(request.foot_normal) < kEdgeCosine ? 1 : 0;
    normals[side] += normal;
    centers[side] += Eigen::Vector3f(patch_[0][i], patch_[1][i], patch_[2][i]);
    counts[side] += 1;
  }
  const bool edge = counts[0] >= 1 && counts[1] >= kLeastEdgePoints &&
                    counts[1] >= kLeastEdgeShare * (counts[0] + counts[1]);
  // Normals that turn away in all directions are noise.
  if (!edge || normals[1].norm() < kLeastConcord * counts[1]) return std::nullopt;
  for (int side = 0; side < 2; ++side) {
    normals[side].normalize();
    centers[side] /= counts[side];
  }
  const float opening = (normals[0] - normals[1]).dot(centers[0] - centers[1]);
  return OtherSide{normals[1], opening > 0};
}

const FitWindow* LocalFitter::Choose(const FitWindow& side, const FitWindow& other, bool convex,
                                     float noise) const {
  const float most = kSheetNoises * noise;
  float alone = 0, other_alone = 0, both = 0;
  for (int i = 0; i < patch_size_; ++i) {
    if (far_square_[i] > kEdgeSpacings * kEdgeSpacings) continue;
    if (std::abs(far_height_[i]) > kEdgeSpacings + most) continue;
    const float first = side.height + side.slope_u * far_u_[i] + side.slope_v * far_v_[i];
    const float second = other.height + other.slope_u * far_u_[i] + other.slope_v * far_v_[i];
    const float met = convex ? std::min(first, second) : std::max(first, second);
    const auto cost = [&](float height) {
      const float off = std::min(std::abs(far_height_[i] - height), most);
      return off * off;
    };
    alone += cost(first);
    other_alone += cost(second);
    both += cost(met);
  }
  if (both > kEdgeCostShare * std::min(alone, other_alone)) {
    return other_alone < kEdgeCostShare * alone ? &other : nullptr;
  }
  return (convex ? other.height < side.height : other.height > side.height) ? &other : &side;
}

LocalFit SelectFit(const MultiscaleFit& view, const FitWindow& window) {
  return {view.height + window.height * view.spacing,
          view.ladder.noise * std::sqrt(window.variance_factor) * view.spacing};
}

ScaleLadder LocalFitter::FitAllScales(const Ray& ray, const LocalFitRequest& request) {
  ScaleLadder ladder = FitScalesOfSide(ray, request, kPlaneCount, kWindowCount);
  if (ladder.count == 0) ladder = FitScalesOfSide(ray, request, 0, kPlaneCount);
  return ladder;
}

std::optional<ScaleLadder> LocalFitter::FitScalesAtEdge(const Ray& ray,
                                                        const LocalFitRequest& request,
                                                        const OtherSide& other_side) {
  const ScaleLadder ladder = FitScalesOfSide(ray, request, 0, kWindowCount);
  LocalFitRequest other_request = request;
  other_request.foot_normal = other_side.normal;
  other_request.deviation = 0;  // what was measured is of this side
  Project(ray, other_request);
  const ScaleLadder other_ladder = FitScalesOfSide(ray, other_request, 0, kWindowCount);
  const auto side = SelectScale(ladder), other = SelectScale(other_ladder);
  const FitWindow* met = side ? &*side : other ? &*other : nullptr;
  if (side && other) {
    met = Choose(*side, *other, other_side.convex, request.noise / request.spacing);
    if (met == nullptr) return std::nullopt;
  }
  // Each ray stands for itself: it says nothing of the region.
  ScaleLadder of_edge;
  of_edge.noise = other && met == &*other ? other_ladder.noise : ladder.noise;
  if (met != nullptr) of_edge.Add(0, *met);
  return of_edge;
}

MultiscaleFit LocalFitter::FitScales(const Ray& ray, const LocalFitRequest& request) {
  MultiscaleFit view = {{}, request.height, request.spacing};
  Project(ray, request);
  if (const auto other_side = FindOtherSide(request)) {
    if (const auto of_edge = FitScalesAtEdge(ray, request, *other_side)) {
      view.ladder = *of_edge;
      return view;
    }
    Project(ray, request);
  }
  view.ladder = FitAllScales(ray, request);
  return view;
}

ScaleLadder LocalFitter::FitScalesOfSide(const Ray& ray, const LocalFitRequest& request, int first,
                                         int last) {
  // In spacings; noise off the surface is longer when measured along a slanted ray.
  const float along = std::max(0.3f, request.foot_normal.dot(ray.direction));
  const float noise = request.noise / request.spacing / along;
  ScaleLadder ladder;
  ladder.noise = noise;
  if (request.deviation > 0) {
    const float factor = along * request.deviation / request.noise;
    ladder.Add(0, {0, -request.foot_normal.dot(ray.u) / along,
                   -request.foot_normal.dot(ray.v) / along, factor * factor});
  }
  for (int w = first; w < last; ++w) {
    const float radius = 0.5f * std::sqrt(kWindowSizes[w].points);
    const float outlier = kOutlierNoises * noise;
    const auto window = kWindowSizes[w].quadric ? Fit<6>(radius, inside_[w], outlier)
                                                : Fit<3>(radius, inside_[w], outlier);
    // A window that knows less than a single point has most of its points on one side.
    if (!window || window->variance_factor > 1) continue;
    if (std::abs(window->height) > kFarthestSpacings + kFarthestNoises * noise) continue;
    if (ladder.count > 0) {
      const FitWindow& narrower = ladder.windows[ladder.count - 1];
      if (window->variance_factor >= narrower.variance_factor) continue;
      if (IsOut(*window, narrower, noise)) break;
    }
    ladder.Add(w + 1, *window);
  }
  return ladder;
}

}  // namespace rilievo

#include "core/displacement/local_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/displacement/normal_equations.h"

namespace rilievo {
namespace {

using Lanes = Eigen::Array4f;
constexpr int kLaneCount = 4;

// Windows by the number of points they hold; the first are planes, the later ones quadrics.
struct WindowSize {
  float points;
  bool quadric;
};
constexpr WindowSize kWindows[] = {{8, false}, {16, false}, {28, true},
                                   {52, true}, {92, true},  {kMostFitPoints, true}};
constexpr int kWindowCount = static_cast<int>(std::size(kWindows));
// A normal at 60 degrees to the foot's has no weight.
constexpr float kNormalCutoff = 0.5f;
// Squared difference to the narrower windows, in variances of theirs, at which a wider window is
// given up; below, it is blended in.
constexpr float kAgreement = 6.0f;
// Points farther off a window's fit than this many noises are dropped.
constexpr float kOutlierNoises = 3.5f;
// The share of the plain variance that remains with weights 1 - r^2 (which are not their square).
constexpr float kKernelVariance = 0.88f;
// Of another sheet, or of none: points steeper against the ray than this (rise over distance).
constexpr float kSteepest = 1.5f;
constexpr float kSheetNoises = 5.0f;
constexpr float kSheetSpacings = 0.5f;

int Padded(int count) { return (count + kLaneCount - 1) / kLaneCount * kLaneCount; }

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
  for (std::vector<float>& component : patch_) component.assign(Padded(patch_size_), 0.0f);
  for (int i = 0; i < patch_size_; ++i) {
    const RayPoint& point = cloud.points[points[i].point];
    for (int axis = 0; axis < 3; ++axis) {
      patch_[axis][i] = point.position[axis];
      patch_[3 + axis][i] = point.normal[axis];
    }
  }
  const int padded = Padded(patch_size_);
  std::vector<float>* const scratch[] = {&far_u_, &far_v_, &far_height_, &far_weight_, &far_square_,
                                         &u_,     &v_,     &height_,     &weight_};
  for (std::vector<float>* array : scratch) array->resize(padded + kLaneCount);
  inside_.resize(kWindowCount);
}

void LocalFitter::Project(const Ray& ray, const LocalFitRequest& request) {
  const float scale = 1.0f / request.spacing;
  const Eigen::Vector3f& normal = request.foot_normal;
  const float window = kSheetNoises * request.noise * scale + kSheetSpacings;
  for (int i = 0; i < Padded(patch_size_); i += kLaneCount) {
    const Lanes x = (At(patch_[0], i) - ray.origin[0]) * scale;
    const Lanes y = (At(patch_[1], i) - ray.origin[1]) * scale;
    const Lanes z = (At(patch_[2], i) - ray.origin[2]) * scale;
    const Lanes u = x * ray.u[0] + y * ray.u[1] + z * ray.u[2];
    const Lanes v = x * ray.v[0] + y * ray.v[1] + z * ray.v[2];
    const Lanes height =
        x * ray.direction[0] + y * ray.direction[1] + z * ray.direction[2] - request.height * scale;
    const Lanes turn = 1.0f - (At(patch_[3], i) * normal[0] + At(patch_[4], i) * normal[1] +
                               At(patch_[5], i) * normal[2]);
    const Lanes keep = (1.0f - turn * (1.0f / kNormalCutoff)).max(0.0f);
    const Lanes square = u * u + v * v;
    const Lanes excess = (height.abs() - window).max(0.0f);
    const Lanes near_sheet = (excess * excess <= kSteepest * kSteepest * square).cast<float>();
    Put(&far_u_, i) = u;
    Put(&far_v_, i) = v;
    Put(&far_height_, i) = height;
    Put(&far_square_, i) = square;
    Put(&far_weight_, i) = keep * keep * near_sheet;
  }
  // Sorted by the narrowest window that holds each point.
  std::array<float, kWindowCount> square_radius;
  for (int w = 0; w < kWindowCount; ++w) square_radius[w] = 0.25f * kWindows[w].points;
  std::array<int, kWindowCount + 1> begin{};
  const auto window_of = [&](int i) {
    if (!(far_weight_[i] > 0)) return kWindowCount;
    int w = 0;
    while (w < kWindowCount && far_square_[i] >= square_radius[w]) ++w;
    return w;
  };
  for (int i = 0; i < patch_size_; ++i) {
    const int w = window_of(i);
    if (w < kWindowCount) ++begin[w + 1];
  }
  for (int w = 0; w < kWindowCount; ++w) {
    begin[w + 1] += begin[w];
    inside_[w] = begin[w + 1];
  }
  for (int i = 0; i < patch_size_; ++i) {
    const int w = window_of(i);
    if (w == kWindowCount) continue;
    const int place = begin[w]++;
    u_[place] = far_u_[i];
    v_[place] = far_v_[i];
    height_[place] = far_height_[i];
    weight_[place] = far_weight_[i];
  }
  for (int i = inside_.back(); i < Padded(inside_.back()); ++i) {
    u_[i] = v_[i] = height_[i] = weight_[i] = 0;
  }
}

template <int kTerms>
std::optional<LocalFitter::Window> LocalFitter::FitWindow(float radius, int inside,
                                                          float outlier_distance) {
  constexpr int kProducts = kTerms * (kTerms + 1) / 2;
  const float scale = 1.0f / radius;
  const int padded = Padded(inside);
  const auto kernel = [&](int i, const Lanes& u, const Lanes& v) -> Lanes {
    return (1.0f - u * u - v * v).max(0.0f) * At(weight_, i);
  };
  Lanes basis[kTerms];
  Lanes coefficients[kTerms];
  std::optional<Window> window;
  for (int round = 0; round < 2; ++round) {
    Lanes products[kProducts];
    Lanes moments[kTerms];
    for (Lanes& sum : products) sum = Lanes::Zero();
    for (Lanes& sum : moments) sum = Lanes::Zero();
    bool dropped = false;
    for (int i = 0; i < padded; i += kLaneCount) {
      const Lanes u = At(u_, i) * scale, v = At(v_, i) * scale, height = At(height_, i);
      Lanes weight = kernel(i, u, v);
      Basis<kTerms>(u, v, basis);
      if (round == 1) {
        Lanes residual = height;
        for (int a = 0; a < kTerms; ++a) residual -= coefficients[a] * basis[a];
        const Lanes keep = (residual.abs() <= outlier_distance).cast<float>();
        dropped |= (keep * weight != weight).any();
        weight *= keep;
      }
      for (int a = 0, place = 0; a < kTerms; ++a) {
        const Lanes weighted = weight * basis[a];
        moments[a] += weighted * height;
        for (int b = 0; b <= a; ++b) products[place++] += weighted * basis[b];
      }
    }
    if (round == 1 && !dropped) break;
    NormalEquations<kTerms> equations;
    for (int a = 0, place = 0; a < kTerms; ++a) {
      equations.solution[a] = moments[a].sum();
      for (int b = 0; b <= a; ++b) equations.matrix(a, b) = products[place++].sum();
    }
    // Half the points of a full plane window, weighed by the kernel's mean of 1/2.
    if (!(equations.matrix(0, 0) > 0.5 * kTerms) || !equations.Solve()) break;
    window = Window{static_cast<float>(equations.solution[0]),
                    static_cast<float>(equations.inverse_first) * kKernelVariance};
    for (int a = 0; a < kTerms; ++a) {
      coefficients[a] = Lanes::Constant(static_cast<float>(equations.solution[a]));
    }
  }
  return window;
}

std::optional<LocalFit> LocalFitter::Fit(const Ray& ray, const LocalFitRequest& request) {
  Project(ray, request);
  // In spacings; noise off the surface is longer when measured along a slanted ray.
  const float noise =
      request.noise / request.spacing / std::max(0.3f, request.foot_normal.dot(ray.direction));
  float height = 0, variance = 0;
  bool fitted = false;
  for (int w = 0; w < kWindowCount; ++w) {
    const float radius = 0.5f * std::sqrt(kWindows[w].points);
    const float outlier = kOutlierNoises * noise;
    const auto window = kWindows[w].quadric ? FitWindow<6>(radius, inside_[w], outlier)
                                            : FitWindow<3>(radius, inside_[w], outlier);
    // A window that knows less than a single point would has most of its points on one side.
    if (!window || window->variance_factor > 1) continue;
    if (!fitted) {
      fitted = true;
      height = window->height;
      variance = window->variance_factor;
    } else if (window->variance_factor < variance) {
      const float off = (window->height - height) / noise;
      const float blend = 1.0f - off * off / (kAgreement * variance);
      if (blend <= 0) break;
      height += blend * (window->height - height);
      variance += blend * (window->variance_factor - variance);
    }
  }
  if (!fitted) return std::nullopt;
  return LocalFit{request.height + height * request.spacing,
                  noise * request.spacing * std::sqrt(variance)};
}

}  // namespace rilievo

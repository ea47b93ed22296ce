#include "core/displacement/local_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace rilievo {
namespace {

using Lanes = Eigen::Array4f;
constexpr int kLaneCount = 4;

// Windows by the number of points within; the first are planes, the later ones quadrics.
struct WindowSize {
  int points;
  bool quadric;
};
constexpr WindowSize kWindows[] = {{7, false}, {14, false}, {24, true},
                                   {48, true}, {90, true},  {kMostFitPoints, true}};
// A normal at 60 degrees to the foot's has no weight.
constexpr float kNormalCutoff = 0.5f;
// Squared difference to the narrower windows, in variances of theirs, at which a wider window is
// given up; below, it is blended in.
constexpr float kAgreement = 2.5f;
// Points farther off a window's fit than this many noises are dropped.
constexpr float kOutlierNoises = 3.5f;
// The share of the plain variance that remains with weights 1 - r^2 (which are not their square).
constexpr float kKernelVariance = 0.88f;

// Solves the symmetric positive system in place by Cholesky; false when it is near singular.
// `inverse_first`: entry (0, 0) of the inverse.
template <int kTerms>
bool SolveNormalEquations(Eigen::Matrix<double, kTerms, kTerms>& matrix,
                          Eigen::Matrix<double, kTerms, 1>& solution, double* inverse_first) {
  constexpr double kLeastPivotRatio = 1e-7;
  const double scale = matrix(0, 0);
  Eigen::Matrix<double, kTerms, 1> first = Eigen::Matrix<double, kTerms, 1>::Zero();
  first[0] = 1;
  for (int j = 0; j < kTerms; ++j) {
    double pivot = matrix(j, j);
    for (int k = 0; k < j; ++k) pivot -= matrix(j, k) * matrix(j, k);
    if (!(pivot > kLeastPivotRatio * scale)) return false;
    matrix(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < kTerms; ++i) {
      double sum = matrix(i, j);
      for (int k = 0; k < j; ++k) sum -= matrix(i, k) * matrix(j, k);
      matrix(i, j) = sum / matrix(j, j);
    }
  }
  for (int i = 0; i < kTerms; ++i) {
    for (int k = 0; k < i; ++k) {
      solution[i] -= matrix(i, k) * solution[k];
      first[i] -= matrix(i, k) * first[k];
    }
    solution[i] /= matrix(i, i);
    first[i] /= matrix(i, i);
  }
  *inverse_first = first.squaredNorm();
  for (int i = kTerms - 1; i >= 0; --i) {
    for (int k = i + 1; k < kTerms; ++k) solution[i] -= matrix(k, i) * solution[k];
    solution[i] /= matrix(i, i);
  }
  return true;
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

bool LocalFitter::Load(std::span<const QueuedPoint> queue, const RayCloud& cloud,
                       const Eigen::Vector3f& foot_normal, float start) {
  const int found = static_cast<int>(queue.size());
  order_.resize(found);
  distance_.resize(found);
  for (int i = 0; i < found; ++i) {
    order_[i] = i;
    distance_[i] = queue[i].u * queue[i].u + queue[i].v * queue[i].v;
  }
  count_ = std::min(found, kMostFitPoints);
  std::partial_sort(order_.begin(), order_.begin() + count_, order_.end(), [&](int a, int b) {
    return distance_[a] != distance_[b] ? distance_[a] < distance_[b]
                                        : queue[a].point < queue[b].point;
  });
  const size_t padded = (count_ + kLaneCount - 1) / kLaneCount * kLaneCount;
  std::vector<float>* const arrays[] = {&u_, &v_, &height_, &weight_, &drop_};
  for (std::vector<float>* array : arrays) array->assign(padded, 0.0f);
  int taking_part = 0;
  for (int i = 0; i < count_; ++i) {
    const QueuedPoint& queued = queue[order_[i]];
    const RayPoint& point = cloud.points[queued.point];
    const float turn = 1.0f - (point.normal[0] * foot_normal[0] + point.normal[1] * foot_normal[1] +
                               point.normal[2] * foot_normal[2]);
    const float keep = std::max(0.0f, 1.0f - turn / kNormalCutoff);
    u_[i] = queued.u;
    v_[i] = queued.v;
    height_[i] = queued.height - start;
    weight_[i] = keep * keep;
    taking_part += keep > 0;
  }
  return taking_part >= kLeastFitPoints;
}

template <int kTerms>
std::optional<LocalFitter::Window> LocalFitter::SolveWindow(float radius, float outlier_distance) {
  constexpr int kProducts = kTerms * (kTerms + 1) / 2;
  Lanes products[kProducts];
  Lanes moments[kTerms];
  for (Lanes& sum : products) sum = Lanes::Zero();
  for (Lanes& sum : moments) sum = Lanes::Zero();
  const float scale = 1.0f / radius;
  int inside = 0;
  while (inside < count_ && distance_[order_[inside]] < radius * radius) ++inside;
  const int padded = (inside + kLaneCount - 1) / kLaneCount * kLaneCount;
  Lanes basis[kTerms];
  const auto weights = [&](int i, const Lanes& u, const Lanes& v) -> Lanes {
    const Lanes kernel = (1.0f - u * u - v * v).max(0.0f);
    return kernel * Eigen::Map<const Lanes>(&weight_[i]) *
           (1.0f - Eigen::Map<const Lanes>(&drop_[i]));
  };
  for (int i = 0; i < padded; i += kLaneCount) {
    const Lanes u = Eigen::Map<const Lanes>(&u_[i]) * scale;
    const Lanes v = Eigen::Map<const Lanes>(&v_[i]) * scale;
    const Lanes weight = weights(i, u, v);
    const Lanes height = Eigen::Map<const Lanes>(&height_[i]);
    Basis<kTerms>(u, v, basis);
    for (int a = 0, place = 0; a < kTerms; ++a) {
      const Lanes weighted = weight * basis[a];
      moments[a] += weighted * height;
      for (int b = 0; b <= a; ++b) products[place++] += weighted * basis[b];
    }
  }
  Eigen::Matrix<double, kTerms, kTerms> matrix;
  Eigen::Matrix<double, kTerms, 1> solution;
  for (int a = 0, place = 0; a < kTerms; ++a) {
    solution[a] = moments[a].sum();
    for (int b = 0; b <= a; ++b) matrix(a, b) = products[place++].sum();
  }
  const double weight_sum = matrix(0, 0);
  if (!(weight_sum > 0.3 * kTerms)) return std::nullopt;
  double inverse_first = 0;
  if (!SolveNormalEquations<kTerms>(matrix, solution, &inverse_first)) return std::nullopt;

  Window window = {static_cast<float>(solution[0]),
                   static_cast<float>(inverse_first) * kKernelVariance, 0,
                   static_cast<float>(weight_sum)};
  Lanes residual_sum = Lanes::Zero();
  Lanes coefficients[kTerms];
  for (int a = 0; a < kTerms; ++a) {
    coefficients[a] = Lanes::Constant(static_cast<float>(solution[a]));
  }
  bool dropped = false;
  for (int i = 0; i < padded; i += kLaneCount) {
    const Lanes u = Eigen::Map<const Lanes>(&u_[i]) * scale;
    const Lanes v = Eigen::Map<const Lanes>(&v_[i]) * scale;
    const Lanes weight = weights(i, u, v);
    Basis<kTerms>(u, v, basis);
    Lanes residual = Eigen::Map<const Lanes>(&height_[i]);
    for (int a = 0; a < kTerms; ++a) residual -= coefficients[a] * basis[a];
    residual_sum += weight * residual.square();
    if (outlier_distance > 0) {
      const Lanes far = (residual.abs() > outlier_distance && weight > 0.0f).cast<float>();
      if (far.any()) {
        Eigen::Map<Lanes> drop(&drop_[i]);
        drop = drop.max(far);
        dropped = true;
      }
    }
  }
  window.residual = std::sqrt(residual_sum.sum() / static_cast<float>(weight_sum));
  if (dropped) {
    const auto again = SolveWindow<kTerms>(radius, 0);
    std::fill(drop_.begin(), drop_.end(), 0.0f);
    return again;
  }
  return window;
}

std::optional<LocalFitter::Window> LocalFitter::FitWindow(float radius, bool quadric,
                                                          float outlier_distance) {
  return quadric ? SolveWindow<6>(radius, outlier_distance)
                 : SolveWindow<3>(radius, outlier_distance);
}

std::optional<LocalFit> LocalFitter::Fit(std::span<const QueuedPoint> queue, const RayCloud& cloud,
                                         const Ray& ray, const Eigen::Vector3f& foot_normal,
                                         float noise, float start, float complete_radius) {
  if (!Load(queue, cloud, foot_normal, start)) return std::nullopt;
  // Noise off the surface is longer when measured along a slanted ray.
  const float along_ray = noise / std::max(0.3f, foot_normal.dot(ray.direction));
  std::optional<LocalFit> fit;
  float variance = 0;  // of `fit`, in squared noises
  for (const WindowSize& size : kWindows) {
    // The radius that holds the wanted number of points, a little beyond the last of them.
    const bool all = size.points >= count_;
    const float squared = distance_[order_[std::min(size.points, count_ - 1)]];
    float radius = std::sqrt(squared) * (all ? 1.05f : 1.0f);
    if (fit && radius > complete_radius) radius = complete_radius;
    if (!(radius > 0)) continue;
    const auto window = FitWindow(radius, size.quadric, kOutlierNoises * along_ray);
    if (!window) continue;
    if (!fit) {
      fit = LocalFit{window->height, 0, window->points};
      variance = window->variance_factor;
    } else if (window->variance_factor < variance) {
      const float off = (window->height - fit->height) / along_ray;
      const float blend = 1.0f - off * off / (kAgreement * variance);
      if (blend <= 0) break;
      fit->height += blend * (window->height - fit->height);
      fit->points += blend * (window->points - fit->points);
      variance += blend * (window->variance_factor - variance);
    }
    if (all || radius >= complete_radius) break;
  }
  if (!fit) return std::nullopt;
  fit->height += start;
  fit->deviation = along_ray * std::sqrt(variance);
  return fit;
}

}  // namespace rilievo

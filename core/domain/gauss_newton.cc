#include "core/domain/gauss_newton.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/domain/fairness.h"

namespace rilievo {
namespace {

// Conjugate gradients end when an iteration adds less than this share of the mean decrease an
// iteration. The spline basis is well conditioned: 2 to 16 iterations end within 1 % of the RMS of
// the exact solution. Over a hole, where fairness alone acts, the rough part of the start is
// smoothed and its overall shape kept.
constexpr double kForcing = 0.1;
constexpr int kMostIterations = 30;
// The residual is computed anew after so many iterations.
constexpr int kResidualReset = 10;
// Share of each control point's own weight, at least this much, that holds it where it is: it only
// keeps the equations regular.
constexpr double kHoldShare = 1e-16;
constexpr double kLeastWeight = 1e-6;
constexpr int64_t kTermsPerTask = 2048;
constexpr int64_t kPointsPerTask = 128;

// Column = term or control point. The fourth row is zero: pairs of doubles are added faster.
using Vectors = Eigen::Matrix4Xd;

double Dot(const Vectors& a, const Vectors& b) { return a.cwiseProduct(b).sum(); }

}  // namespace

GaussNewton::GaussNewton(const DomainSamples& samples, const AreaShares& areas)
    : samples_(samples), umbrella_areas_(areas.control_vertices) {
  const LimitStencils& stencils = samples.stencils;
  const int points = samples.control_vertex_count();
  for (int v = 0; v < points; ++v) {
    const std::vector<int> vertices = UmbrellaOf(samples, v).vertices;
    const auto neighbors = static_cast<double>(vertices.size() - 1);
    for (size_t k = 0; k < vertices.size() && neighbors > 0; ++k) {
      umbrellas_.columns.push_back(vertices[k]);
      umbrellas_.weights.push_back(k == 0 ? -1 : 1 / neighbors);
    }
    umbrellas_.begin.push_back(static_cast<int>(umbrellas_.columns.size()));
  }
  Rows& transposed = terms_of_point_;
  transposed.begin.assign(static_cast<size_t>(points) + 1, 0);
  for (const int v : stencils.control_vertices) ++transposed.begin[v + 1];
  for (const int v : umbrellas_.columns) ++transposed.begin[v + 1];
  for (int v = 0; v < points; ++v) transposed.begin[v + 1] += transposed.begin[v];
  transposed.columns.resize(static_cast<size_t>(transposed.begin.back()));
  transposed.weights.resize(transposed.columns.size());
  std::vector<int> next(transposed.begin.begin(), transposed.begin.end() - 1);
  const auto add = [&](int point, int term, double weight) {
    const auto place = static_cast<size_t>(next[point]++);
    transposed.columns[place] = term;
    transposed.weights[place] = weight;
  };
  for (int i = 0; i < samples.size(); ++i) {
    for (int e = stencils.begin[i]; e < stencils.begin[i + 1]; ++e) {
      add(stencils.control_vertices[e], i, stencils.position[e]);
    }
  }
  for (int v = 0; v < points; ++v) {
    for (int e = umbrellas_.begin[v]; e < umbrellas_.begin[v + 1]; ++e) {
      add(umbrellas_.columns[e], samples.size() + v, umbrellas_.weights[e]);
    }
  }
}

// The normal equations of one round.
class GaussNewton::System {
 public:
  System(const GaussNewton& terms, const SampleTargets& targets, double fairness,
         const RunContext& context)
      : terms_(terms), targets_(targets), fairness_(fairness), context_(context) {
    terms_out_.setZero(4, sample_count() + point_count());
  }

  int point_count() const { return terms_.samples_.control_vertex_count(); }

  // Half the negative gradient of E.
  absl::Status RightHandSide(const Vectors& points, Vectors* out) {
    RILIEVO_RETURN_IF_ERROR(ForTerms([&](int term) {
      Eigen::Vector4d miss = -Combine(term, points);
      if (term < sample_count()) miss.head<3>() += targets_.positions.col(term);
      return Weigh(term, miss);
    }));
    return Gather(nullptr, out);
  }

  absl::Status Multiply(const Vectors& x, Vectors* out) {
    RILIEVO_RETURN_IF_ERROR(ForTerms([&](int term) { return Weigh(term, Combine(term, x)); }));
    return Gather(&x, out);
  }

  // Fills the blocks on the diagonal, and what they add to it.
  absl::Status Factor() {
    hold_.resize(3, point_count());
    blocks_.resize(static_cast<size_t>(point_count()));
    return ParallelFor(point_count(), kPointsPerTask, context_, [&](int64_t begin, int64_t end) {
      const Rows& rows = terms_.terms_of_point_;
      for (int64_t v = begin; v < end; ++v) {
        Eigen::Matrix3d block = Eigen::Matrix3d::Zero();
        for (int e = rows.begin[v]; e < rows.begin[v + 1]; ++e) {
          AddSquare(rows.columns[e], rows.weights[e] * rows.weights[e], &block);
        }
        hold_.col(v) = kHoldShare * block.diagonal().cwiseMax(kLeastWeight);
        block.diagonal() += hold_.col(v);
        blocks_[v] = block.ldlt();
      }
    });
  }

  // z = M^-1 r, M the blocks on the diagonal.
  void Precondition(const Vectors& r, Vectors* z) const {
    for (int v = 0; v < point_count(); ++v) {
      z->col(v).head<3>() = blocks_[v].solve(r.col(v).head<3>());
    }
  }

 private:
  int sample_count() const { return terms_.samples_.size(); }

  template <typename OfTerm>
  absl::Status ForTerms(const OfTerm& of_term) {
    return ParallelFor(terms_out_.cols(), kTermsPerTask, context_, [&](int64_t begin, int64_t end) {
      for (int64_t t = begin; t < end; ++t) {
        terms_out_.col(t) = of_term(static_cast<int>(t));
      }
    });
  }

  // Sums the terms of each control point, and what holds it where it is by `hold`, unless null.
  absl::Status Gather(const Vectors* hold, Vectors* out) {
    const Rows& rows = terms_.terms_of_point_;
    return ParallelFor(point_count(), kPointsPerTask, context_, [&](int64_t begin, int64_t end) {
      for (int64_t v = begin; v < end; ++v) {
        Eigen::Vector4d sum = Eigen::Vector4d::Zero();
        for (int e = rows.begin[v]; e < rows.begin[v + 1]; ++e) {
          sum += rows.weights[e] * terms_out_.col(rows.columns[e]);
        }
        if (hold != nullptr) sum.head<3>() += hold_.col(v).cwiseProduct(hold->col(v).head<3>());
        out->col(v) = sum;
      }
    });
  }

  // The stencil of a term applied to points.
  Eigen::Vector4d Combine(int term, const Vectors& points) const {
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    const auto add = [&](const auto& begin, const auto& columns, const auto& weights, int row) {
      for (int e = begin[row]; e < begin[row + 1]; ++e) sum += weights[e] * points.col(columns[e]);
    };
    const LimitStencils& stencils = terms_.samples_.stencils;
    if (term < sample_count()) {
      add(stencils.begin, stencils.control_vertices, stencils.position, term);
    } else {
      const Rows& umbrellas = terms_.umbrellas_;
      add(umbrellas.begin, umbrellas.columns, umbrellas.weights, term - sample_count());
    }
    return sum;
  }

  double UmbrellaWeight(int term) const {
    return fairness_ * terms_.umbrella_areas_[static_cast<size_t>(term - sample_count())];
  }

  auto Direction(int sample, int r) const {
    return targets_.weighted_directions.block<3, 1>(3 * r, sample);
  }

  // The matrix of a term times a vector.
  Eigen::Vector4d Weigh(int term, const Eigen::Vector4d& vector) const {
    if (term >= sample_count()) return UmbrellaWeight(term) * vector;
    Eigen::Vector4d sum = Eigen::Vector4d::Zero();
    for (int r = 0; r < targets_.row_count[static_cast<size_t>(term)]; ++r) {
      sum.head<3>() += Direction(term, r).dot(vector.head<3>()) * Direction(term, r);
    }
    return sum;
  }

  void AddSquare(int term, double factor, Eigen::Matrix3d* block) const {
    if (term >= sample_count()) {
      block->diagonal().array() += factor * UmbrellaWeight(term);
      return;
    }
    for (int r = 0; r < targets_.row_count[static_cast<size_t>(term)]; ++r) {
      *block += factor * Direction(term, r) * Direction(term, r).transpose();
    }
  }

  const GaussNewton& terms_;
  const SampleTargets& targets_;
  const double fairness_;
  const RunContext& context_;
  Vectors terms_out_;  // by term, of the pass that is under way
  Eigen::Matrix3Xd hold_;
  std::vector<Eigen::LDLT<Eigen::Matrix3d>> blocks_;
};

absl::Status GaussNewton::Step(const SampleTargets& targets, double fairness,
                               const RunContext& context, Eigen::Matrix3Xd* control_points) const {
  System system(*this, targets, fairness, context);
  const int count = system.point_count();
  Vectors points = Vectors::Zero(4, count), b = points, x = points, z = points, q = points;
  points.topRows<3>() = *control_points;
  RILIEVO_RETURN_IF_ERROR(system.RightHandSide(points, &b));
  RILIEVO_RETURN_IF_ERROR(system.Factor());
  Vectors r = b, p;
  double rho = 0, decrease = 0;
  for (int iteration = 1; iteration <= kMostIterations; ++iteration) {
    system.Precondition(r, &z);
    const double last_rho = rho;
    rho = Dot(r, z);
    if (!(rho > 0 && std::isfinite(rho))) break;
    if (iteration == 1) {
      p = z;
    } else {
      p = z + rho / last_rho * p;
    }
    RILIEVO_RETURN_IF_ERROR(system.Multiply(p, &q));
    const double curvature = Dot(p, q);
    if (!(curvature > 0 && std::isfinite(curvature))) break;
    x += rho / curvature * p;
    if (iteration % kResidualReset == 0) {
      RILIEVO_RETURN_IF_ERROR(system.Multiply(x, &r));
      r = b - r;
    } else {
      r -= rho / curvature * q;
    }
    const double before = decrease;
    decrease = Dot(x, b + r);
    if (iteration * (decrease - before) < kForcing * decrease) break;
  }
  *control_points += x.topRows<3>();
  return absl::OkStatus();
}

}  // namespace rilievo

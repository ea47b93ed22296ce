#include "core/bicubic/cubic_spline.h"

#include <algorithm>
#include <array>
#include <vector>

namespace rilievo {
namespace {

constexpr int kDegree = 3;

// The four B-splines that do not vanish on span `span`, at t in [0, spans], by the recurrence of
// Cox and de Boor (Piegl and Tiller, The NURBS Book, algorithm A2.2). The first one is that of
// control point `span`.
std::array<double, kDegree + 1> SplinesOnSpan(int spans, int span, double t) {
  const auto knot = [spans](int i) { return std::clamp(i, 0, spans); };  // with ends repeated
  std::array<double, kDegree + 1> values = {1, 0, 0, 0};
  for (int degree = 1; degree <= kDegree; ++degree) {
    double carried = 0;
    for (int r = 0; r < degree; ++r) {
      const int right = knot(span + r + 1), left = knot(span + 1 - degree + r);
      const double share = values[static_cast<size_t>(r)] / (right - left);
      values[static_cast<size_t>(r)] = carried + (right - t) * share;
      carried = (t - left) * share;
    }
    values[static_cast<size_t>(degree)] = carried;
  }
  return values;
}

}  // namespace

Eigen::SparseMatrix<double> BasisOfSpans(int spans, int intervals) {
  std::vector<Eigen::Triplet<double>> entries;
  for (int i = 0; i <= intervals; ++i) {
    const double t = static_cast<double>(i) * spans / intervals;
    const int span = std::min(static_cast<int>(t), spans - 1);
    const auto values = SplinesOnSpan(spans, span, t);
    for (int k = 0; k <= kDegree; ++k) {
      entries.emplace_back(i, span + k, values[static_cast<size_t>(k)]);
    }
  }
  Eigen::SparseMatrix<double> basis(intervals + 1, spans + kDegree);
  basis.setFromTriplets(entries.begin(), entries.end());
  return basis;
}

CubicSpline::CubicSpline(int spans, int intervals)
    : spans_(spans), basis_(BasisOfSpans(spans, intervals)) {
  const Eigen::SparseMatrix<double> inner = basis_.middleCols(1, control_count() - 2);
  inner_ = std::make_unique<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>>(inner.transpose() *
                                                                                inner);
}

Eigen::MatrixXd CubicSpline::FitInside(const Eigen::MatrixXd& rest) const {
  return inner_->solve(basis_.middleCols(1, control_count() - 2).transpose() * rest);
}

Eigen::Matrix3Xd CubicSpline::FitCurve(const Eigen::Matrix3Xd& samples) const {
  const Eigen::Index last = control_count() - 1;
  Eigen::Matrix3Xd control(3, control_count());
  control.col(0) = samples.col(0);
  control.col(last) = samples.col(samples.cols() - 1);
  const Eigen::Matrix3Xd ends =
      control.col(0) * basis_.col(0).transpose() + control.col(last) * basis_.col(last).transpose();
  control.middleCols(1, last - 1) = FitInside((samples - ends).transpose()).transpose();
  return control;
}

}  // namespace rilievo

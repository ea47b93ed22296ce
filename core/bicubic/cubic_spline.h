// Cubic B-splines over equal spans, fitted to samples by least squares.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <memory>

namespace rilievo {

// (intervals + 1) x (spans + 3): what each control point of `spans` equal spans weighs at each of
// the samples at i / `intervals`.
Eigen::SparseMatrix<double> BasisOfSpans(int spans, int intervals);

// The B-splines of degree 3 on [0, 1] with `spans` equal spans and knots of multiplicity 4 at both
// ends, so that a curve begins and ends in its first and last control point. Two orders of
// derivatives are continuous; with one span they are Bernstein's polynomials.
class CubicSpline {
 public:
  // spans >= 1; samples at i / `intervals`, of which there are more than control points.
  CubicSpline(int spans, int intervals);

  int spans() const { return spans_; }
  int intervals() const { return static_cast<int>(basis_.rows()) - 1; }
  int control_count() const { return spans_ + 3; }

  // BasisOfSpans(spans, intervals).
  const Eigen::SparseMatrix<double>& basis() const { return basis_; }

  // (control_count() - 2) x n: from what the first and the last control point leave of the samples,
  // (intervals + 1) x n, to the control points between them, in the sense of least squares.
  Eigen::MatrixXd FitInside(const Eigen::MatrixXd& rest) const;

  // The control points, a column each, of the curve nearest to the samples, a column each, that
  // passes through the first and the last one.
  Eigen::Matrix3Xd FitCurve(const Eigen::Matrix3Xd& samples) const;

 private:
  int spans_;
  Eigen::SparseMatrix<double> basis_;
  std::unique_ptr<Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>> inner_;
};

}  // namespace rilievo

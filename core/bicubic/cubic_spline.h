// Cubic B-splines over equal spans, fitted to samples by least squares.
#pragma once

#include <Eigen/Core>

namespace rilievo {

// The B-splines of degree 3 on [0, 1] with `spans` equal spans and knots of multiplicity 4 at both
// ends, so that a curve begins and ends in its first and last control point. Two orders of
// derivatives are continuous; with one span they are Bernstein's polynomials.
class CubicSpline {
 public:
  // spans >= 1; samples at i / `intervals`, of which there are more than control points.
  CubicSpline(int spans, int intervals);

  int spans() const { return spans_; }
  int control_count() const { return spans_ + 3; }

  // (intervals + 1) x control_count(): what each control point weighs at each sample.
  const Eigen::MatrixXd& basis() const { return basis_; }

  // (control_count() - 2) x (intervals + 1): from what the first and the last control point leave
  // of the samples to the control points between them, in the sense of least squares.
  const Eigen::MatrixXd& inner_fit() const { return inner_fit_; }

  // The control points, a column each, of the curve nearest to the samples, a column each, that
  // passes through the first and the last one.
  Eigen::Matrix3Xd FitCurve(const Eigen::Matrix3Xd& samples) const;

 private:
  int spans_;
  Eigen::MatrixXd basis_, inner_fit_;
};

}  // namespace rilievo

#include "core/control/planar/harmonic_fill.h"

#include <Eigen/SparseCholesky>
#include <vector>

#include "core/control/planar/settings.h"

namespace rilievo {

void HarmonicFill(const Eigen::Matrix3Xi& faces, const std::vector<uint8_t>& known,
                  Eigen::VectorXd* values) {
  std::vector<int> unknown(known.size(), -1);
  int count = 0;
  double sum = 0;
  for (size_t v = 0; v < known.size(); ++v) {
    if (known[v] == 0) {
      unknown[v] = count++;
    } else {
      sum += (*values)[static_cast<int64_t>(v)];
    }
  }
  if (count == 0) return;
  const auto known_count = static_cast<int>(known.size()) - count;
  const double mean = known_count > 0 ? sum / known_count : 0;
  // The least weight on the mean of all makes the matrix definite where nothing is known.
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd right = Eigen::VectorXd::Constant(count, kHarmonicFill.hold * mean);
  for (int i = 0; i < count; ++i) entries.emplace_back(i, i, kHarmonicFill.hold);
  // Inner edges are met twice and boundary edges once: half the weight along the boundary.
  for (int f = 0; f < faces.cols(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int ends[2] = {faces(k, f), faces((k + 1) % 3, f)};
      for (int side = 0; side < 2; ++side) {
        const int row = unknown[ends[side]], other = ends[1 - side];
        if (row < 0) continue;
        entries.emplace_back(row, row, 1.0);
        if (unknown[other] >= 0) {
          entries.emplace_back(row, unknown[other], -1.0);
        } else {
          right[row] += (*values)[other];
        }
      }
    }
  }
  Eigen::SparseMatrix<double> matrix(count, count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  const Eigen::VectorXd filled = solver.solve(right);
  for (size_t v = 0; v < known.size(); ++v) {
    if (unknown[v] >= 0) (*values)[static_cast<int64_t>(v)] = filled[unknown[v]];
  }
}

}  // namespace rilievo

#include "core/domain/fit_border.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "core/base/status_macros.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/crease_topology.h"
#include "core/surface/segment_tree.h"

namespace rilievo {
namespace {

constexpr int kBorderRounds = 12;
constexpr int kSamplesPerEdge = 8;
// Of a sample's weight: what holds a control point along the line, where nothing else does.
constexpr double kHoldAlong = 1e-3;

// A sample of the curve: four weights of control points of the loop.
struct CurveSample {
  std::array<int, 4> points;
  std::array<double, 4> weights;
};

// Uniform cubic B-spline; beyond a corner the polygon goes on straight (p_-1 = 2 p_0 - p_1), which
// is what the rules of Loop's corners come to.
std::vector<CurveSample> SamplesOfLoop(const std::vector<uint8_t>& corner) {
  const auto count = static_cast<int>(corner.size());
  const auto at = [&](int i) { return (i + count) % count; };
  std::vector<CurveSample> samples;
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < kSamplesPerEdge; ++k) {
      const double t = static_cast<double>(k) / kSamplesPerEdge, s = 1 - t;
      CurveSample sample{{at(i - 1), i, at(i + 1), at(i + 2)},
                         {s * s * s / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
                          (3 * s * s * s - 6 * s * s + 4) / 6, t * t * t / 6}};
      auto& w = sample.weights;
      if (corner[static_cast<size_t>(i)] != 0) {
        w[1] += 2 * w[0];
        w[2] -= w[0];
        w[0] = 0;
      }
      if (corner[static_cast<size_t>(at(i + 1))] != 0) {
        w[2] += 2 * w[3];
        w[1] -= w[3];
        w[3] = 0;
      }
      samples.push_back(sample);
    }
  }
  return samples;
}

// The nearest point of the lines, and the direction of its segment; zero at the end of one, where
// the nearest point is that end whatever way the sample moves.
struct LineFoot {
  Eigen::Vector3d place, along;
};

class BorderLines {
 public:
  BorderLines(const Eigen::Matrix3Xd& ends, const ClosestPointTree& tree)
      : ends_(ends), tree_(tree) {}

  LineFoot FootOf(const Eigen::Vector3d& point) const {
    const auto [from, way] = SegmentNear(point);
    const double part = std::clamp((point - from).dot(way) / way.squaredNorm(), 0.0, 1.0);
    return {from + part * way, way.normalized()};
  }
  Eigen::Vector3d EndNear(const Eigen::Vector3d& point) const {
    const auto [from, way] = SegmentNear(point);
    const Eigen::Vector3d to = from + way;
    return (point - from).squaredNorm() <= (point - to).squaredNorm() ? from : to;
  }

 private:
  std::pair<Eigen::Vector3d, Eigen::Vector3d> SegmentNear(const Eigen::Vector3d& point) const {
    const int segment = tree_.source()[tree_.Closest(point).item];
    const Eigen::Vector3d from = ends_.col(2 * segment);
    return {from, ends_.col(2 * segment + 1) - from};
  }
  const Eigen::Matrix3Xd& ends_;
  const ClosestPointTree& tree_;
};

// One round of Gauss and Newton for the points of a loop, of which corners stay.
bool FitLoopOnce(const std::vector<CurveSample>& samples, const std::vector<uint8_t>& corner,
                 const BorderLines& lines, Eigen::Matrix3Xd* points) {
  const Eigen::Index count = points->cols();
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(3 * count);
  for (const CurveSample& sample : samples) {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    for (size_t k = 0; k < 4; ++k) place += sample.weights[k] * points->col(sample.points[k]);
    const LineFoot foot = lines.FootOf(place);
    const Eigen::Matrix3d across =
        Eigen::Matrix3d::Identity() - foot.along * foot.along.transpose();
    const Eigen::Vector3d miss = across * (foot.place - place);
    for (size_t j = 0; j < 4; ++j) {
      right.segment<3>(3 * sample.points[j]) += sample.weights[j] * miss;
      for (size_t k = 0; k < 4; ++k) {
        const double weight = sample.weights[j] * sample.weights[k];
        if (weight == 0) continue;
        for (int row = 0; row < 3; ++row) {
          for (int column = 0; column < 3; ++column) {
            entries.emplace_back(3 * sample.points[j] + row, 3 * sample.points[k] + column,
                                 weight * across(row, column));
          }
        }
      }
    }
  }
  for (int v = 0; v < count; ++v) {
    // A corner stays where it is.
    const double hold = corner[static_cast<size_t>(v)] != 0 ? 1e9 : kHoldAlong;
    for (int axis = 0; axis < 3; ++axis) entries.emplace_back(3 * v + axis, 3 * v + axis, hold);
  }
  Eigen::SparseMatrix<double> matrix(3 * count, 3 * count);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(matrix);
  if (factors.info() != Eigen::Success) return false;
  const Eigen::VectorXd move = factors.solve(right);
  if (!move.allFinite()) return false;
  *points += Eigen::Map<const Eigen::Matrix3Xd>(move.data(), 3, count);
  return true;
}

}  // namespace

absl::Status FitBorder(const Eigen::Matrix3Xd& ends, const RunContext& context, ControlMesh* mesh) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh->faces, static_cast<int>(mesh->vertices.cols())));
  RILIEVO_ASSIGN_OR_RETURN(const CreaseTopology creases, BuildCreaseTopology(*mesh, topology));
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree, TreeOfSegments(ends, context));
  const BorderLines lines(ends, tree);
  for (const std::vector<int>& loop : BoundaryLoops(topology)) {
    std::vector<uint8_t> corner;
    Eigen::Matrix3Xd points(3, static_cast<Eigen::Index>(loop.size()));
    for (size_t i = 0; i < loop.size(); ++i) {
      const auto v = static_cast<size_t>(loop[i]);
      corner.push_back(creases.kinds[v] == VertexKind::kCorner ? 1 : 0);
      const Eigen::Vector3d place = mesh->vertices.col(loop[i]);
      points.col(static_cast<Eigen::Index>(i)) = corner.back() != 0 ? lines.EndNear(place) : place;
    }
    const std::vector<CurveSample> samples = SamplesOfLoop(corner);
    for (int round = 0; round < kBorderRounds; ++round) {
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      if (!FitLoopOnce(samples, corner, lines, &points)) break;
    }
    for (size_t i = 0; i < loop.size(); ++i) {
      mesh->vertices.col(loop[i]) = points.col(static_cast<Eigen::Index>(i));
    }
  }
  return absl::OkStatus();
}

}  // namespace rilievo

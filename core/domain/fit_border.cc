#include "core/domain/fit_border.h"

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/status_macros.h"
#include "core/domain/settings.h"
#include "core/geometry/mesh_topology.h"
#include "core/loop/crease_topology.h"
#include "core/points/settings.h"
#include "core/surface/segment_tree.h"

namespace rilievo {
namespace {

// A loop of the border in its order.
struct BorderLoop {
  std::vector<int> vertices;
  std::vector<uint8_t> corner;
  Eigen::Matrix3Xd points;  // of the control mesh
};

// A sample of the curve: four weights of control points of the loop.
struct CurveSample {
  std::array<int, 4> points;
  std::array<double, 4> weights;

  Eigen::Vector3d PlaceAmong(const Eigen::Matrix3Xd& control) const {
    Eigen::Vector3d place = Eigen::Vector3d::Zero();
    for (size_t k = 0; k < 4; ++k) place += weights[k] * control.col(points[k]);
    return place;
  }
};

// Uniform cubic B-spline, kFitBorder.samples_per_edge for each edge. Beyond a corner the polygon
// goes on straight (p_-1 = 2 p_0 - p_1), which is what the rules of corners come to.
std::vector<CurveSample> SamplesOfLoop(const std::vector<uint8_t>& corner) {
  const auto count = static_cast<int>(corner.size());
  const auto at = [&](int i) { return (i + count) % count; };
  std::vector<CurveSample> samples;
  for (int i = 0; i < count; ++i) {
    for (int k = 0; k < kFitBorder.samples_per_edge; ++k) {
      const double t = static_cast<double>(k) / kFitBorder.samples_per_edge, s = 1 - t;
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

class BorderFit {
 public:
  BorderFit(const KnownBorders& borders, const ClosestPointTree& tree)
      : borders_(borders), tree_(tree) {}

  void PlaceCorners(BorderLoop* loop) const {
    const Eigen::Index count = loop->points.cols();
    const Eigen::Matrix3Xd before = loop->points;
    for (Eigen::Index i = 0; i < count; ++i) {
      if (loop->corner[static_cast<size_t>(i)] == 0) continue;
      auto place = loop->points.col(i);
      const double reach = std::min((before.col(i) - before.col((i + 1) % count)).norm(),
                                    (before.col(i) - before.col((i + count - 1) % count)).norm());
      Eigen::Index nearest = -1;
      if (borders_.corners.cols() > 0 &&
          (borders_.corners.colwise() - place).colwise().squaredNorm().minCoeff(&nearest) <
              reach * reach) {
        place = borders_.corners.col(nearest);
      } else {
        place = FootOf(place).place;
      }
    }
  }

  // One round of Gauss and Newton for the points of a loop, of which corners stay. Whether they
  // have moved by more than kCommon.at_rest.
  bool Round(const std::vector<CurveSample>& samples, BorderLoop* loop) const {
    const Eigen::Index count = loop->points.cols();
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(3 * count);
    for (const CurveSample& sample : samples) {
      const Eigen::Vector3d place = sample.PlaceAmong(loop->points);
      const SegmentPlace foot = FootOf(place);
      Eigen::Matrix3d across = Eigen::Matrix3d::Identity();
      Eigen::Vector3d miss = foot.place - place;
      // A sample slides along its segment, but not beyond an end of the line.
      if (std::abs(foot.along.dot(miss)) < kFitBorder.on_segment) {
        across -= foot.along * foot.along.transpose();
        miss = across * miss;
      }
      for (size_t j = 0; j < 4; ++j) {
        right.segment<3>(3 * sample.points[j]) += sample.weights[j] * miss;
        for (size_t k = 0; k < 4; ++k) {
          const double weight = sample.weights[j] * sample.weights[k];
          // The factorisation reads the lower half.
          if (weight == 0 || sample.points[k] > sample.points[j]) continue;
          for (int row = 0; row < 3; ++row) {
            for (int column = 0; column < 3; ++column) {
              entries.emplace_back(3 * sample.points[j] + row, 3 * sample.points[k] + column,
                                   weight * across(row, column));
            }
          }
        }
      }
    }
    for (int i = 0; i < static_cast<int>(3 * count); ++i) {
      const bool is_corner = loop->corner[static_cast<size_t>(i / 3)] != 0;
      entries.emplace_back(i, i, is_corner ? kFitBorder.hold_corner : kFitBorder.hold_along);
    }
    Eigen::SparseMatrix<double> matrix(3 * count, 3 * count);
    matrix.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factors(matrix);
    if (factors.info() != Eigen::Success) return false;
    const Eigen::VectorXd move = factors.solve(right);
    if (!move.allFinite()) return false;
    loop->points += Eigen::Map<const Eigen::Matrix3Xd>(move.data(), 3, count);
    return move.cwiseAbs().maxCoeff() > kCommon.at_rest;
  }

  // How far the curve is off between each control point and the next.
  std::vector<double> MissOf(const std::vector<CurveSample>& samples,
                             const BorderLoop& loop) const {
    std::vector<double> misses(loop.vertices.size(), 0);
    for (size_t s = 0; s < samples.size(); ++s) {
      const Eigen::Vector3d place = samples[s].PlaceAmong(loop.points);
      double& miss = misses[s / kFitBorder.samples_per_edge];
      miss = std::max(miss, (FootOf(place).place - place).norm());
    }
    return misses;
  }

 private:
  SegmentPlace FootOf(const Eigen::Vector3d& place) const {
    return NearestOnSegments(tree_, borders_.lines, place);
  }

  const KnownBorders& borders_;
  const ClosestPointTree& tree_;
};

}  // namespace

absl::StatusOr<BorderMiss> FitBorder(const KnownBorders& borders, double allowed,
                                     const RunContext& context, ControlMesh* mesh) {
  RILIEVO_ASSIGN_OR_RETURN(const MeshTopology topology,
                           BuildMeshTopology(mesh->faces, static_cast<int>(mesh->vertices.cols())));
  RILIEVO_ASSIGN_OR_RETURN(const CreaseTopology creases, BuildCreaseTopology(*mesh, topology));
  RILIEVO_ASSIGN_OR_RETURN(const ClosestPointTree tree, TreeOfSegments(borders.lines, context));
  const BorderFit fit(borders, tree);
  BorderMiss miss;
  for (std::vector<int>& vertices : BoundaryLoops(topology)) {
    BorderLoop loop{std::move(vertices), {}, {}};
    for (const int v : loop.vertices) {
      const bool is_corner = creases.kinds[static_cast<size_t>(v)] == VertexKind::kCorner;
      loop.corner.push_back(is_corner ? 1 : 0);
    }
    loop.points = mesh->vertices(Eigen::all, loop.vertices);
    fit.PlaceCorners(&loop);
    const std::vector<CurveSample> samples = SamplesOfLoop(loop.corner);
    for (int round = 0; round < kFitBorder.border_rounds; ++round) {
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      if (!fit.Round(samples, &loop)) break;
    }
    mesh->vertices(Eigen::all, loop.vertices) = loop.points;
    const std::vector<double> misses = fit.MissOf(samples, loop);
    for (size_t i = 0; i < misses.size(); ++i) {
      miss.most = std::max(miss.most, misses[i]);
      if (misses[i] > allowed) {
        miss.far.push_back({loop.vertices[i], loop.vertices[(i + 1) % misses.size()]});
      }
    }
  }
  return miss;
}

}  // namespace rilievo

#include "core/displacement/continue_curvature.h"

#include <Eigen/Geometry>
#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <utility>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/displacement/regularize/height_bounds.h"
#include "core/displacement/settings.h"
#include "core/loop/split_normals.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using SparseMatrix = Eigen::SparseMatrix<double>;
using Triplets = std::vector<Eigen::Triplet<double>>;

// A part and what lies around it. Vertices are numbered from the part outwards, ring by ring.
struct Surroundings {
  std::vector<int> vertices;
  int part = 0;       // vertices of the part
  int moved = 0;      // and of the band around it, which moves with it for a while
  int curved = 0;     // and those beyond that have a curvature
  double radius = 0;  // of the part: twice its area over its rim, in edges
};

// At a vertex: the unit normal, which is that of a sphere through it and its neighbours where there
// is one (Max 1999), the circumcentric area (Meyer, Desbrun, Schroeder and Barr 2003), and the
// cotangent weight of each neighbour. On a sphere n . sum w_ij (x_j - x_i) / area is then -2 / r
// for any triangles.
struct Fan {
  Vector3d normal = Vector3d::Zero();
  double area = 0;
  std::vector<double> weights;
};

// Of one part. Of `heights` and `place`, by vertex, only those of its surroundings are touched.
class CurvatureContinuation {
 public:
  CurvatureContinuation(const LevelRings& rings, const LimitSurface& limit,
                        std::vector<float>* heights, std::vector<int>* place)
      : rings_(rings), limit_(limit), heights_(*heights), place_(*place) {}

  void Continue(const Surroundings& around, double max_height, const RunContext& context) {
    const std::vector<int>& vertices = around.vertices;
    for (size_t i = 0; i < vertices.size(); ++i) place_[vertices[i]] = static_cast<int>(i);
    std::vector<float> before;
    for (const int v : vertices) before.push_back(heights_[v]);
    double first = -1, least = 0;
    bool bounded = false;  // a height is at its bound, so that the rest have not found their place
    Eigen::SimplicialLDLT<SparseMatrix> solver;
    for (int step = 0; step <= kContinueCurvature.most_steps; ++step) {
      if (!context.CheckStop().ok()) return;
      Linearize(around);
      Eigen::VectorXd off = Eigen::VectorXd::Zero(around.moved), held = off;
      for (int i = around.part; i < around.moved; ++i) {
        held[i] = HeldBy(around, i);
        off[i] = double{heights_[vertices[i]]} - double{before[i]};
      }
      least = curvature_.dot(stiffness_ * curvature_) + off.dot(held.cwiseProduct(off));
      if (first < 0) first = least;
      if (step == kContinueCurvature.most_steps) break;
      const SparseMatrix transposed = by_height_.transpose();
      SparseMatrix equations = transposed * stiffness_ * by_height_;
      equations.diagonal() += held;
      if (step == 0) solver.analyzePattern(equations);  // the same for all
      solver.factorize(equations);
      if (solver.info() != Eigen::Success) break;
      const Eigen::VectorXd move =
          solver.solve(-(transposed * (stiffness_ * curvature_)) - held.cwiseProduct(off));
      if (!move.allFinite()) break;
      bounded = false;
      for (int i = 0; i < around.moved; ++i) {
        const HeightBounds bounds = BoundsOf(vertices[i], rings_, limit_, max_height);
        float& height = heights_[vertices[i]];
        const auto moved = static_cast<float>(height + move[i]);
        height = std::clamp(moved, bounds.lowest, bounds.highest);
        bounded |= height != moved;
      }
      if (move.lpNorm<Eigen::Infinity>() < kContinueCurvature.least_move) break;
    }
    const int kept = least < first && !bounded ? around.part : 0;
    for (size_t i = kept; i < vertices.size(); ++i) heights_[vertices[i]] = before[i];
  }

 private:
  Vector3d At(int v) const {
    return limit_.positions.col(v) + double{heights_[v]} * limit_.normals.col(v);
  }

  // Of a vertex with faces all around.
  Fan FanOf(int v) const {
    const Ring ring = rings_.Of(v);
    const Vector3d here = At(v);
    Fan fan;
    fan.weights.assign(static_cast<size_t>(ring.size()), 0);
    double double_area = 0;
    for (int k = 0; k < ring.size(); ++k) {
      const int next = k + 1 < ring.size() ? k + 1 : 0;
      const Vector3d a = At(ring[k]) - here, b = At(ring[next]) - here;
      const Vector3d cross = a.cross(b);
      const double area = std::max(cross.norm(), kContinueCurvature.least_double_area);
      fan.normal += cross / std::max(a.squaredNorm() * b.squaredNorm(), 1e-300);
      fan.weights[k] += b.dot(b - a) / area / 2;
      fan.weights[next] += a.dot(a - b) / area / 2;
      double_area += area;
    }
    fan.normal.normalize();
    for (int k = 0; k < ring.size(); ++k) {
      fan.area += fan.weights[k] * (At(ring[k]) - here).squaredNorm() / 4;
    }
    fan.area = std::max(fan.area,
                        kContinueCurvature.least_share * double_area / 6);  // of obtuse triangles
    return fan;
  }

  // A wave of number k has k^6 times its square, area by area, as the square of its change of
  // curvature; what holds the heights of the band has this times it.
  double HeldBy(const Surroundings& around, int i) const {
    const double edge = std::sqrt(2 / std::numbers::sqrt3 * areas_.mean());
    return areas_[i] * std::pow(kContinueCurvature.noise_share * around.radius * edge, -6);
  }

  // Twice the mean curvature of each vertex that has one, by how much it grows with each height
  // that moves, and the weights of its differences.
  void Linearize(const Surroundings& around) {
    Triplets slopes, stiffness;
    curvature_.resize(around.curved);
    areas_.resize(around.curved);
    for (int i = 0; i < around.curved; ++i) {
      const int v = around.vertices[i];
      const Ring ring = rings_.Of(v);
      const Fan fan = FanOf(v);
      const Vector3d here = At(v);
      const auto add = [&](int vertex, double weight) {
        const int column = place_[vertex];
        if (column >= around.moved) return;
        slopes.emplace_back(i, column,
                            weight / fan.area * fan.normal.dot(limit_.normals.col(vertex)));
      };
      Vector3d sum = Vector3d::Zero();
      double weights = 0;
      for (int k = 0; k < ring.size(); ++k) {
        const double weight = fan.weights[k];
        sum += weight * (At(ring[k]) - here);
        weights += weight;
        add(ring[k], weight);
        const int other = place_[ring[k]];
        if (other >= around.curved) continue;
        const double stiff = std::max(weight, 0.0) / 2;  // each edge is met from both ends
        stiffness.emplace_back(i, i, stiff);
        stiffness.emplace_back(other, other, stiff);
        stiffness.emplace_back(i, other, -stiff);
        stiffness.emplace_back(other, i, -stiff);
      }
      add(v, -weights);
      areas_[i] = fan.area;
      curvature_[i] = fan.normal.dot(sum) / fan.area;
    }
    by_height_.resize(around.curved, around.moved);
    by_height_.setFromTriplets(slopes.begin(), slopes.end());
    stiffness_.resize(around.curved, around.curved);
    stiffness_.setFromTriplets(stiffness.begin(), stiffness.end());
  }

  const LevelRings& rings_;
  const LimitSurface& limit_;
  std::vector<float>& heights_;
  std::vector<int>& place_;  // of each vertex among the surroundings
  Eigen::VectorXd curvature_, areas_;
  SparseMatrix by_height_, stiffness_;
};

// The part of filled vertices around `seed`, and what lies around. `marks`: all 0, as they are
// afterwards.
Surroundings SurroundingsOf(int seed, const LevelRings& rings,
                            const std::vector<HeightSource>& source, std::vector<uint8_t>* marks) {
  Surroundings around;
  std::vector<int>& found = around.vertices;
  size_t grown = 0;  // all neighbours of so many were asked
  const auto grow = [&](const auto& takes) {
    for (const size_t end = found.size(); grown < end; ++grown) {
      for (const int n : rings.Of(found[grown])) {
        if ((*marks)[n] != 0 || !takes(n)) continue;
        (*marks)[n] = 1;
        found.push_back(n);
      }
    }
    return static_cast<int>(found.size());
  };
  const auto all = [](int) { return true; };
  (*marks)[seed] = 1;
  found.push_back(seed);
  while (grown < found.size()) {
    around.part = grow([&](int n) { return source[n] == HeightSource::kFilled; });
  }
  grown = 0;
  const int rim = grow(all) - around.part;
  around.radius = std::numbers::sqrt3 * around.part / std::max(rim, 1);
  const int band =
      std::max(1, static_cast<int>(std::lround(kContinueCurvature.band_share * around.radius)));
  for (int ring = 1; ring < band; ++ring) grow(all);
  around.moved = static_cast<int>(found.size());
  for (int ring = 0; ring < kContinueCurvature.curvature_rings; ++ring) around.curved = grow(all);
  grow(all);
  for (const int v : found) (*marks)[v] = 0;
  return around;
}

// Parts whose surroundings have vertices in common come one after the other, in their order; those
// of a list have none, and move no more vertices together than a single part may. `marks`: by
// vertex, all 0.
std::vector<std::vector<Surroundings>> ListsApart(std::vector<Surroundings> parts,
                                                  std::vector<int> marks) {
  std::vector<std::vector<Surroundings>> lists;
  std::vector<int> moved;  // by list
  for (Surroundings& part : parts) {
    size_t at = 0;
    for (const int v : part.vertices) at = std::max(at, static_cast<size_t>(marks[v]));
    while (at < lists.size() && moved[at] + part.moved > kContinueCurvature.most_continued) ++at;
    for (const int v : part.vertices) marks[v] = static_cast<int>(at) + 1;
    if (at == lists.size()) {
      lists.emplace_back();
      moved.push_back(0);
    }
    moved[at] += part.moved;
    lists[at].push_back(std::move(part));
  }
  return lists;
}

}  // namespace

absl::Status ContinueCurvature(const LoopRefinement& refinement, const LevelRings& rings,
                               const LimitSurface& limit, const DisplacementOptions& options,
                               const RunContext& context, DisplacementField* field) {
  std::vector<uint8_t> is_edge = refinement.levels.back().boundary_vertex;
  RILIEVO_ASSIGN_OR_RETURN(const SharpSectors sectors,
                           SectorsOfLevel(refinement, refinement.max_level()));
  for (const int v : sectors.vertices) is_edge[v] = 1;
  std::vector<uint8_t> marks(field->source.size(), 0), is_done = marks;
  std::vector<Surroundings> parts;
  for (size_t seed = 0; seed < marks.size(); ++seed) {
    if (field->source[seed] != HeightSource::kFilled || is_done[seed] != 0) continue;
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    Surroundings around = SurroundingsOf(static_cast<int>(seed), rings, field->source, &marks);
    for (int i = 0; i < around.part; ++i) is_done[around.vertices[i]] = 1;
    const auto curved = around.vertices.begin() + around.curved;
    const bool is_all = around.vertices.size() == static_cast<size_t>(around.part);
    if (is_all || around.moved > kContinueCurvature.most_continued ||
        std::any_of(around.vertices.begin(), curved, [&](int v) { return is_edge[v] != 0; })) {
      continue;
    }
    parts.push_back(std::move(around));
  }
  std::vector<int> place(marks.size(), 0);
  for (const std::vector<Surroundings>& list : ListsApart(std::move(parts), place)) {
    const auto count = static_cast<int64_t>(list.size());
    RILIEVO_RETURN_IF_ERROR(ParallelFor(count, 1, context, [&](int64_t begin, int64_t end) {
      for (int64_t i = begin; i < end; ++i) {
        CurvatureContinuation(rings, limit, &field->heights, &place)
            .Continue(list[static_cast<size_t>(i)], options.max_height, context);
      }
    }));
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  }
  return absl::OkStatus();
}

}  // namespace rilievo

#include "core/displacement/solve/solve_heights.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <optional>
#include <vector>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/loop/split_normals.h"
#include "core/surface/closest_point_tree.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;

double Env(const char* name, double value) {
  const char* text = std::getenv(name);
  return text ? std::atof(text) : value;
}

struct Footprint {
  std::array<int, 3> corner = {-1, -1, -1};
  std::array<float, 3> weight = {0, 0, 0};
  float height = 0;     // times `along`
  float along = 0;
};

class Projector {
 public:
  Projector(const OrientedCloud& cloud, const MeshTopology& finest, const LevelRings& rings,
            const LimitSurface& limit, const DisplacementOptions& options)
      : cloud_(cloud), finest_(finest), rings_(rings), limit_(limit), options_(options) {}

  // From a vertex near it.
  std::optional<Footprint> Project(int point, int start) const {
    const Vector3d p = cloud_.points.col(point);
    const Ring first = rings_.Of(start);
    std::array<int, 3> c = {start, first[0], first[1]};
    double h = (p - limit_.positions.col(start)).dot(limit_.normals.col(start));
    Vector3d w(1. / 3, 1. / 3, 1. / 3);
    for (int step = 0; step < 40; ++step) {
      const bool met = Solve(p, c, &w, &h);
      int worst = 0;
      for (int k = 1; k < 3; ++k)
        if (w[k] < w[worst]) worst = k;
      if (w[worst] >= -1e-4) return met ? Make(point, c, w, h) : std::nullopt;
      const int a = c[(worst + 1) % 3], b = c[(worst + 2) % 3];
      const int next = Across(a, b, c[worst]);
      if (next < 0) {
        // Beyond the rim.
        if (w[worst] < -1) return std::nullopt;
        w[worst] = 0;
        w = w.cwiseMax(0);
        w /= w.sum();
        return Make(point, c, w, h);
      }
      c[worst] = next;
      // keep orientation irrelevant
      w = Vector3d(1. / 3, 1. / 3, 1. / 3);
    }
    return std::nullopt;
  }

  Footprint AtVertex(int point, int v) const {
    Footprint f;
    const double along = limit_.normals.col(v).dot(cloud_.normals.col(point));
    const double offset =
        (cloud_.points.col(point) - limit_.positions.col(v)).dot(cloud_.normals.col(point));
    if (!(along > 0.5) || !(std::abs(offset) < options_.max_height)) return f;
    f.corner[0] = v;
    f.weight[0] = f.along = static_cast<float>(along);
    f.height = static_cast<float>(offset);
    return f;
  }

 private:
  std::optional<Footprint> Make(int point, const std::array<int, 3>& c, Vector3d w,
                                double h) const {
    w = w.cwiseMax(0);
    w /= w.sum();
    Vector3d normal = Vector3d::Zero();
    for (int k = 0; k < 3; ++k) normal += w[k] * limit_.normals.col(c[k]);
    const double cosine = normal.normalized().dot(cloud_.normals.col(point));
    if (!(cosine > options_.min_normal_agreement) || !(std::abs(h) <= options_.max_height)) {
      return std::nullopt;
    }
    Footprint f;
    f.corner = c;
    f.along = 0;
    for (int k = 0; k < 3; ++k) {
      const double along = limit_.normals.col(c[k]).dot(cloud_.normals.col(point));
      f.weight[k] = static_cast<float>(w[k] * along);
      f.along += f.weight[k];
    }
    f.height = static_cast<float>(h) * f.along;
    return f;
  }

  bool Solve(const Vector3d& p, const std::array<int, 3>& c, Vector3d* w, double* h) const {
    const Vector3d s0 = limit_.positions.col(c[0]), s1 = limit_.positions.col(c[1]),
                   s2 = limit_.positions.col(c[2]);
    const Vector3d n0 = limit_.normals.col(c[0]), n1 = limit_.normals.col(c[1]),
                   n2 = limit_.normals.col(c[2]);
    double w1 = (*w)[1], w2 = (*w)[2], height = *h;
    double off = 0;
    for (int i = 0; i < 8; ++i) {
      const double w0 = 1 - w1 - w2;
      const Vector3d n = w0 * n0 + w1 * n1 + w2 * n2;
      const Vector3d f = w0 * s0 + w1 * s1 + w2 * s2 + height * n - p;
      off = f.norm();
      if (off < 1e-3 * (s1 - s0).norm()) break;
      Eigen::Matrix3d j;
      j.col(0) = s1 - s0 + height * (n1 - n0);
      j.col(1) = s2 - s0 + height * (n2 - n0);
      j.col(2) = n;
      const Vector3d d = j.inverse() * f;
      if (!d.allFinite()) break;
      w1 -= d[0];
      w2 -= d[1];
      height -= d[2];
      if (std::abs(w1) > 50 || std::abs(w2) > 50) break;
    }
    w1 = std::clamp(w1, -50., 50.);
    w2 = std::clamp(w2, -50., 50.);
    *w = Vector3d(1 - w1 - w2, w1, w2);
    *h = std::clamp(height, -1., 1.);
    return off < 1e-2 * (s1 - s0).norm();
  }

  int Across(int a, int b, int from) const {
    const Ring ring = rings_.Of(a);
    const int n = ring.size();
    const bool rim = finest_.boundary_vertex[a] != 0;
    for (int i = 0; i < n; ++i) {
      if (ring[i] != b) continue;
      const int after = i + 1 < n ? ring[i + 1] : (rim ? -1 : ring[0]);
      const int before = i > 0 ? ring[i - 1] : (rim ? -1 : ring[n - 1]);
      if (after == from) return before;
      return after;
    }
    return -1;
  }

  const OrientedCloud& cloud_;
  const MeshTopology& finest_;
  const LevelRings& rings_;
  const LimitSurface& limit_;
  const DisplacementOptions& options_;
};

absl::StatusOr<std::vector<Footprint>> ProjectAll(const OrientedCloud& cloud,
                                                  const LoopRefinement& refinement,
                                                  const LevelRings& rings,
                                                  const LimitSurface& limit,
                                                  const DisplacementOptions& options,
                                                  const RunContext& context) {
  const int level = std::max(0, refinement.max_level() - 1);
  const MeshTopology& coarser = refinement.levels[level];
  const Eigen::Matrix3Xd places = limit.positions.leftCols(coarser.vertex_count);
  RILIEVO_ASSIGN_OR_RETURN(
      const ClosestPointTree tree,
      ClosestPointTree::Build(places, coarser.faces, context,
                              coarser.face_count() / refinement.levels[0].face_count()));
  Projector projector(cloud, refinement.levels.back(), rings, limit, options);
  const int64_t count = cloud.points.cols();
  std::vector<Footprint> feet(count);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(count, 2048, context, [&](int64_t begin, int64_t end) {
    int hint = -1;
    for (int64_t p = begin; p < end; ++p) {
      const Vector3d point = cloud.points.col(p);
      const auto hit = tree.Closest(point, hint);
      hint = hit.item;
      const auto start_of = [&](int item) {
        const auto face = coarser.faces.col(tree.source()[item]);
        int best = face[0];
        for (int k = 1; k < 3; ++k)
          if ((limit.positions.col(face[k]) - point).squaredNorm() <
              (limit.positions.col(best) - point).squaredNorm())
            best = face[k];
        return best;
      };
      auto f = projector.Project(static_cast<int>(p), start_of(hit.item));
      if (!f) {
        std::array<ClosestPointTree::Hit, 24> hits;
        const int found = tree.Nearest(point, hits);
        for (int i = 1; i < found && !f; ++i) {
          const int start = start_of(hits[i].item);
          if (limit.normals.col(start).dot(cloud.normals.col(p)) < options.min_normal_agreement)
            continue;
          f = projector.Project(static_cast<int>(p), start);
        }
      }
      if (f) {
        feet[p] = *f;
      } else if (Env("S_VERTEX", 0) > 0) {
        feet[p] = projector.AtVertex(static_cast<int>(p), start_of(hit.item));
      }
    }
  }));
  return feet;
}

// One level of the problem.
struct Level {
  int count = 0;
  std::vector<int> begin, ring;        // flat rings; rows
  std::vector<float> factor;           // of each neighbour in the row
  std::vector<float> inverse_edge2;    // 1 / mean squared edge
  std::vector<uint8_t> row;            // takes part
  std::vector<float> bend;             // of the domain itself
  std::vector<Footprint> feet;
};

class Problem {
 public:
  Problem(const Level& level, const std::vector<float>& a, const std::vector<float>& row_weight)
      : l_(level), a_(a), r_(row_weight), lap_(level.count), diag_(level.count, 0) {
    for (size_t i = 0; i < l_.feet.size(); ++i) {
      const Footprint& f = l_.feet[i];
      if (f.corner[0] < 0 || a_[i] <= 0) continue;
      for (int k = 0; k < 3; ++k)
        if (f.corner[k] >= 0) diag_[f.corner[k]] += a_[i] * f.weight[k] * f.weight[k];
    }
    for (int v = 0; v < l_.count; ++v) {
      if (!l_.row[v]) continue;
      diag_[v] += r_[v];
      const int n = l_.begin[v + 1] - l_.begin[v];
      for (int j = l_.begin[v]; j < l_.begin[v + 1]; ++j)
        if (l_.factor[j] != 0)
          diag_[l_.ring[j]] += r_[v] * l_.factor[j] * l_.factor[j];
      (void)n;
    }
    for (auto& d : diag_)
      if (!(d > 0)) d = 1;
  }

  void Apply(const std::vector<double>& h, std::vector<double>* y) {
    std::fill(y->begin(), y->end(), 0);
    for (size_t i = 0; i < l_.feet.size(); ++i) {
      const Footprint& f = l_.feet[i];
      if (f.corner[0] < 0 || a_[i] <= 0) continue;
      double s = 0;
      for (int k = 0; k < 3; ++k)
        if (f.corner[k] >= 0) s += f.weight[k] * h[f.corner[k]];
      s *= a_[i];
      for (int k = 0; k < 3; ++k)
        if (f.corner[k] >= 0) (*y)[f.corner[k]] += s * f.weight[k];
    }
    for (int v = 0; v < l_.count; ++v) {
      if (!l_.row[v]) continue;
      double s = -h[v];
      for (int j = l_.begin[v]; j < l_.begin[v + 1]; ++j) s += l_.factor[j] * h[l_.ring[j]];
      lap_[v] = s * r_[v];
    }
    for (int v = 0; v < l_.count; ++v) {
      if (!l_.row[v]) continue;
      (*y)[v] -= lap_[v];
      for (int j = l_.begin[v]; j < l_.begin[v + 1]; ++j)
        (*y)[l_.ring[j]] += l_.factor[j] * lap_[v];
    }
  }

  std::vector<double> RightSide() const {
    std::vector<double> b(l_.count, 0);
    for (size_t i = 0; i < l_.feet.size(); ++i) {
      const Footprint& f = l_.feet[i];
      if (f.corner[0] < 0 || a_[i] <= 0) continue;
      for (int k = 0; k < 3; ++k)
        if (f.corner[k] >= 0) b[f.corner[k]] += a_[i] * f.weight[k] * double{f.height};
    }
    for (int v = 0; v < l_.count; ++v) {
      if (!l_.row[v]) continue;
      const double g = r_[v] * l_.bend[v];
      b[v] += g;
      for (int e = l_.begin[v]; e < l_.begin[v + 1]; ++e) b[l_.ring[e]] -= l_.factor[e] * g;
    }
    return b;
  }

  int Solve(int steps, double tolerance, std::vector<double>* h) {
    const int n = l_.count;
    std::vector<double> r = RightSide(), y(n), z(n), p(n);
    double b2 = 0;
    for (int i = 0; i < n; ++i) b2 += r[i] * r[i] / diag_[i];
    Apply(*h, &y);
    double rz = 0;
    for (int i = 0; i < n; ++i) {
      r[i] -= y[i];
      z[i] = r[i] / diag_[i];
      rz += r[i] * z[i];
    }
    p = z;
    int step = 0;
    for (; step < steps && rz > tolerance * tolerance * b2 && rz > 0; ++step) {
      Apply(p, &y);
      double py = 0;
      for (int i = 0; i < n; ++i) py += p[i] * y[i];
      if (!(py > 0)) break;
      const double alpha = rz / py;
      double next = 0;
      for (int i = 0; i < n; ++i) {
        (*h)[i] += alpha * p[i];
        r[i] -= alpha * y[i];
        z[i] = r[i] / diag_[i];
        next += r[i] * z[i];
      }
      const double beta = next / rz;
      for (int i = 0; i < n; ++i) p[i] = z[i] + beta * p[i];
      rz = next;
    }
    return step;
  }

  double ValueAt(size_t i, const std::vector<double>& h) const {
    const Footprint& f = l_.feet[i];
    double s = 0;
    for (int k = 0; k < 3; ++k)
      if (f.corner[k] >= 0) s += f.weight[k] * h[f.corner[k]];
    return s;
  }

 private:
  const Level& l_;
  const std::vector<float>& a_;
  const std::vector<float>& r_;
  std::vector<double> lap_;
  std::vector<float> diag_;
};

}  // namespace

absl::StatusOr<HeightSamples> SolveHeights(const OrientedCloud& cloud,
                                           const LoopRefinement& refinement,
                                           const LevelRings& rings, const LimitSurface& limit,
                                           const DisplacementOptions& options,
                                           const RunContext& context) {
  const int finest = refinement.max_level();
  const int64_t count = cloud.points.cols();
  RILIEVO_ASSIGN_OR_RETURN(std::vector<Footprint> feet,
                           ProjectAll(cloud, refinement, rings, limit, options, context));
  if (Env("S_TALK", 0) > 0) {
    int64_t lost = 0;
    for (const Footprint& f : feet) lost += f.corner[0] < 0;
    std::cerr << "lost " << lost << " of " << count << "\n";
    if (const char* file = std::getenv("S_LOST")) {
      FILE* out = std::fopen(file, "w");
      for (int64_t i = 0; i < count; ++i)
        if (feet[i].corner[0] < 0)
          std::fprintf(out, "%g %g %g\n", cloud.points(0, i), cloud.points(1, i),
                       cloud.points(2, i));
      std::fclose(out);
    }
  }
  // Levels.
  std::vector<Level> levels(finest + 1);
  for (int l = finest; l >= 0; --l) {
    Level& level = levels[l];
    const MeshTopology& topology = refinement.levels[l];
    level.count = topology.vertex_count;
    level.begin.assign(level.count + 1, 0);
    level.row.assign(level.count, 1);
    level.bend.assign(level.count, 0);
    level.inverse_edge2.assign(level.count, 0);
    const VertexRings table = l < finest ? BuildVertexRings(topology) : VertexRings();
    const LevelRings own = l < finest ? LevelRings(table) : rings;
    RILIEVO_ASSIGN_OR_RETURN(const SharpSectors sectors, SectorsOfLevel(refinement, l));
    std::vector<uint8_t> sharp(level.count, 0);
    for (int v : sectors.vertices) sharp[v] = 1;
    for (int v = 0; v < level.count; ++v) {
      const Ring ring = own.Of(v);
      level.begin[v] = static_cast<int>(level.ring.size());
      double edge2 = 0;
      for (int j = 0; j < ring.size(); ++j) {
        edge2 += (limit.positions.col(ring[j]) - limit.positions.col(v)).squaredNorm();
      }
      edge2 /= ring.size();
      level.inverse_edge2[v] = static_cast<float>(1 / std::max(edge2, 1e-20));
      const bool rim = topology.boundary_vertex[v] != 0;
      double sum = 0;
      int creases = 0;
      for (int j = 0; j < ring.size(); ++j) creases += sharp[ring[j]];
      for (int j = 0; j < ring.size(); ++j) {
        const double c = limit.normals.col(ring[j]).dot(limit.normals.col(v));
        bool in_row = true;
        if (rim) in_row = j == 0 || j + 1 == ring.size();
        if (sharp[v]) in_row = creases == 2 && sharp[ring[j]];
        level.ring.push_back(ring[j]);
        level.factor.push_back(in_row ? static_cast<float>(c) : 0.f);
        if (in_row) sum += 1;
      }
      if (sum > 0) {
        Vector3d mean = Vector3d::Zero();
        for (size_t j = level.begin[v]; j < level.ring.size(); ++j) {
          if (level.factor[j] == 0) continue;
          mean += limit.positions.col(level.ring[j]) / sum;
          level.factor[j] /= sum;
        }
        level.bend[v] = static_cast<float>(
            Env("S_TOTAL", 0) * (mean - limit.positions.col(v)).dot(limit.normals.col(v)));
      } else {
        level.row[v] = 0;
      }
    }
    level.begin[level.count] = static_cast<int>(level.ring.size());
    if (l == finest) {
      level.feet = feet;
    } else {
      // Weights of the vertices on edges go half to each end.
      const int old = topology.vertex_count;
      level.feet.resize(count);
      for (int64_t i = 0; i < count; ++i) {
        const Footprint& fine = levels[l + 1].feet[i];
        Footprint& f = level.feet[i];
        f.height = fine.height;
        f.along = fine.along;
        int used = 0;
        const auto add = [&](int v, float w) {
          for (int k = 0; k < used; ++k)
            if (f.corner[k] == v) {
              f.weight[k] += w;
              return;
            }
          if (used < 3) {
            f.corner[used] = v;
            f.weight[used++] = w;
          }
        };
        for (int k = 0; k < 3; ++k) {
          const int v = fine.corner[k];
          if (v < 0) continue;
          if (v < old) {
            add(v, fine.weight[k]);
          } else {
            const auto ends = topology.edge_vertices.col(v - old);
            add(ends[0], fine.weight[k] / 2);
            add(ends[1], fine.weight[k] / 2);
          }
        }
      }
    }
  }
  // Local spacing and noise at the vertices of each level: mean over the points of the star, pushed
  // to where there are none.
  const auto spread = [&](const Level& level, const auto& value_of) {
    std::vector<double> sum(level.count, 0), weight(level.count, 0);
    for (int64_t i = 0; i < count; ++i) {
      const Footprint& f = level.feet[i];
      for (int k = 0; k < 3; ++k) {
        if (f.corner[k] < 0) continue;
        sum[f.corner[k]] += f.weight[k] * value_of(i);
        weight[f.corner[k]] += f.weight[k];
      }
    }
    return std::pair(std::move(sum), std::move(weight));
  };
  std::vector<std::vector<float>> spacing(finest + 1);
  for (int l = 0; l <= finest; ++l) {
    auto [sum, weight] = spread(levels[l], [&](int64_t i) { return cloud.spacing[i]; });
    spacing[l].resize(levels[l].count);
    for (int v = 0; v < levels[l].count; ++v) {
      if (weight[v] > 0.05) {
        spacing[l][v] = static_cast<float>(sum[v] / weight[v]);
      } else if (l > 0 && v >= levels[l - 1].count) {
        const auto ends = refinement.levels[l - 1].edge_vertices.col(v - levels[l - 1].count);
        spacing[l][v] = 0.5f * (spacing[l - 1][ends[0]] + spacing[l - 1][ends[1]]);
      } else {
        spacing[l][v] = l > 0 ? spacing[l - 1][v] : static_cast<float>(cloud.median_spacing);
      }
    }
  }
  std::vector<float> a(count);
  for (int64_t i = 0; i < count; ++i) a[i] = feet[i].corner[0] >= 0 ? 1 : 0;
  const auto rows_of = [&](int l, const auto& t_of) {
    std::vector<float> r(levels[l].count, 0);
    for (int v = 0; v < levels[l].count; ++v) {
      const double t = t_of(v), s = spacing[l][v];
      r[v] = static_cast<float>(t * t * t * t * s * s * levels[l].inverse_edge2[v] * 17.6);
    }
    return r;
  };
  const auto prolong = [&](int l, const std::vector<double>& coarse) {
    std::vector<double> fine(levels[l].count);
    std::copy(coarse.begin(), coarse.end(), fine.begin());
    const MeshTopology& topology = refinement.levels[l - 1];
    for (int e = 0; e < topology.edge_count(); ++e) {
      const auto ends = topology.edge_vertices.col(e);
      fine[topology.vertex_count + e] = 0.5 * (coarse[ends[0]] + coarse[ends[1]]);
    }
    return fine;
  };
  const double shrink = Env("S_SIGMA", 1.0);
  const double least = Env("S_TMIN", 0.35);
  const int kSteps = static_cast<int>(Env("S_STEPS", 40));
  const bool talk = Env("S_TALK", 0) > 0;
  // Solves coarse to fine with t given by level and vertex.
  const auto solve = [&](const auto& t_at, int last) {
    std::vector<double> h(levels[0].count, 0);
    for (int l = 0; l <= last; ++l) {
      if (l > 0) h = prolong(l, h);
      const auto rows = rows_of(l, [&](int v) { return t_at(l, v); });
      Problem problem(levels[l], a, rows);
      const int its = problem.Solve(l == last ? kSteps : 2 * kSteps, 1e-4, &h);
      if (talk) std::cerr << "  level " << l << " steps " << its << "\n";
    }
    return h;
  };
  const auto reweigh = [&](const std::vector<double>& h, int l) {
    int64_t low = 0;
    for (int64_t i = 0; i < count; ++i) {
      if (feet[i].corner[0] < 0) continue;
      const Footprint& f = levels[l].feet[i];
      double s = 0;
      for (int k = 0; k < 3; ++k)
        if (f.corner[k] >= 0) s += f.weight[k] * h[f.corner[k]];
      const double r = s - f.height;
      const double m =
          Env("S_ROBUST", 3) * std::max(1.0 * cloud.noise[i], 0.15 * cloud.spacing[i]);
      const double q = r / m;
      a[i] = static_cast<float>(1 / ((1 + q * q) * (1 + q * q)));
      low += q > 1;
    }
    if (talk) std::cerr << "  far " << low << " of " << count << "\n";
  };
  // The level on which regions are judged: some 60 points a vertex.
  int judge = 0;
  while (judge < finest && levels[judge + 1].count * Env("S_REGION", 40) < count) ++judge;
  // Robust weights from a middle scale.
  {
    const auto h = solve([&](int, int) { return Env("S_T0", 1.0); }, finest);
    reweigh(h, finest);
  }
  std::vector<double> ladder;
  for (double t = least; t < Env("S_TMAX", 9); t *= Env("S_RATIO", 1.5)) ladder.push_back(t);
  std::vector<double> best(levels[judge].count, 1e300), chosen(levels[judge].count, least);
  double least_edge2 = 0;
  for (int v = 0; v < levels[finest].count; ++v) least_edge2 += 1 / levels[finest].inverse_edge2[v];
  least_edge2 /= levels[finest].count;
  // What the domain itself takes of the points' freedom.
  std::vector<std::vector<double>> own(1);
  own[0] = spread(levels[0], [&](int64_t i) { return double{a[i]}; }).second;
  for (double& points : own[0]) points = Env("S_KAPPA", 1.5) / std::max(points, 3.0);
  for (int l = 1; l <= judge; ++l) own.push_back(prolong(l, own[l - 1]));
  for (const double t : ladder) {
    // Fine enough for its scale.
    int last = finest;
    double edge = std::sqrt(least_edge2);
    while (last > judge && last > 0 && 2 * edge < Env("S_COARSE", 0.5) * t * cloud.median_spacing) {
      --last;
      edge *= 2;
    }
    const auto h = solve([&](int, int) { return t; }, last);
    double lev = 0.098 / (t * t) / (1 + 0.098 / (t * t));
    if (Env("S_HUTCH", 0) > 0) {
      std::vector<std::vector<float>> kept(finest + 1);
      uint64_t seed = 88172645463325252ull;
      std::vector<float> z(count);
      for (int64_t i = 0; i < count; ++i) {
        seed ^= seed << 13;
        seed ^= seed >> 7;
        seed ^= seed << 17;
        z[i] = (seed >> 33) & 1 ? 1.f : -1.f;
      }
      for (int l = 0; l <= finest; ++l) {
        kept[l].resize(count);
        for (int64_t i = 0; i < count; ++i) {
          kept[l][i] = levels[l].feet[i].height;
          levels[l].feet[i].height = z[i];
        }
      }
      const auto hz = solve([&](int, int) { return t; }, last);
      double trace = 0, total_a = 0;
      for (int64_t i = 0; i < count; ++i) {
        const Footprint& f = levels[last].feet[i];
        if (feet[i].corner[0] < 0) continue;
        double s = 0;
        for (int k = 0; k < 3; ++k)
          if (f.corner[k] >= 0) s += f.weight[k] * hz[f.corner[k]];
        trace += z[i] * s * a[i];
        total_a += a[i];
      }
      for (int l = 0; l <= finest; ++l)
        for (int64_t i = 0; i < count; ++i) levels[l].feet[i].height = kept[l][i];
      if (talk) std::cerr << "lev " << lev << " hutchinson " << trace / total_a << "\n";
      lev = trace / total_a;
    }
    std::vector<double> risk(count);
    for (int64_t i = 0; i < count; ++i) {
      const Footprint& f = levels[last].feet[i];
      double s = 0;
      for (int k = 0; k < 3; ++k)
        if (f.corner[k] >= 0) s += f.weight[k] * h[f.corner[k]];
      const double sigma = shrink * cloud.noise[i];
      const double c2 = a[i];
      const double r2 = (s - f.height) * (s - f.height);
      risk[i] = Env("S_GCV", 1) > 0 ? c2 * r2
                                    : c2 * (r2 - sigma * sigma + 2 * sigma * sigma * lev);
    }
    auto [sum, weight] = spread(levels[judge], [&](int64_t i) { return risk[i]; });
    auto [ws, weight2] = spread(levels[judge], [&](int64_t i) { return double{a[i]}; });
    // one ring average
    const Level& l = levels[judge];
    double total = 0;
    for (int v = 0; v < l.count; ++v) {
      double s = sum[v], w = ws[v];
      for (int j = l.begin[v]; j < l.begin[v + 1]; ++j) s += sum[l.ring[j]], w += ws[l.ring[j]];
      if (w <= 0) continue;
      total += sum[v];
      const double both = std::min(0.9, std::hypot(lev, own[judge][v]));
      const double score = s / w / ((1 - both) * (1 - both));
      if (score < best[v]) {
        best[v] = score;
        chosen[v] = t;
      }
    }
    if (talk)
      std::cerr << "t " << t << " level " << last << " of " << finest << " risk "
                << total / count / (cloud.median_noise * cloud.median_noise) << "\n";
  }
  // Smooth the logarithm.
  std::vector<double> log_t(levels[judge].count);
  for (int v = 0; v < levels[judge].count; ++v) log_t[v] = std::log(chosen[v]);
  for (int round = 0; round < 2; ++round) {
    std::vector<double> next(log_t);
    const Level& l = levels[judge];
    for (int v = 0; v < l.count; ++v) {
      double s = log_t[v];
      for (int j = l.begin[v]; j < l.begin[v + 1]; ++j) s += log_t[l.ring[j]];
      next[v] = s / (1 + l.begin[v + 1] - l.begin[v]);
    }
    log_t = next;
  }
  std::vector<std::vector<double>> log_ts(finest + 1);
  log_ts[judge] = log_t;
  for (int l = judge + 1; l <= finest; ++l) log_ts[l] = prolong(l, log_ts[l - 1]);
  for (int l = judge - 1; l >= 0; --l) {
    log_ts[l].assign(log_ts[l + 1].begin(), log_ts[l + 1].begin() + levels[l].count);
  }
  if (talk) {
    std::vector<double> sorted = log_t;
    std::sort(sorted.begin(), sorted.end());
    std::cerr << "chosen t: " << std::exp(sorted[0]) << " " << std::exp(sorted[sorted.size() / 4])
              << " " << std::exp(sorted[sorted.size() / 2]) << " "
              << std::exp(sorted[3 * sorted.size() / 4]) << " " << std::exp(sorted.back()) << "\n";
  }
  std::vector<double> h;
  for (int round = 0; round < 2; ++round) {
    h = solve([&](int l, int v) { return std::exp(log_ts[l][v]); }, finest);
    if (round == 0) reweigh(h, finest);
  }
  // Flags.
  HeightSamples samples(levels[finest].count);
  const Level& top = levels[finest];
  std::vector<double> away(top.count, 1e300);
  for (int64_t i = 0; i < count; ++i) {
    const Footprint& f = top.feet[i];
    for (int k = 0; k < 3; ++k) {
      if (f.corner[k] < 0 || a[i] < 0.1f) continue;
      away[f.corner[k]] = 0;
      samples.foot[f.corner[k]] = static_cast<int>(i);
    }
  }
  const double reach = Env("S_REACH", 1.5);
  for (int sweep = 0; sweep < 12; ++sweep) {
    std::vector<double> next(away);
    for (int v = 0; v < top.count; ++v) {
      for (int j = top.begin[v]; j < top.begin[v + 1]; ++j) {
        next[v] = std::min(next[v], away[top.ring[j]] +
                                        (limit.positions.col(v) - limit.positions.col(top.ring[j]))
                                            .norm());
      }
    }
    away.swap(next);
  }
  if (const char* at = std::getenv("S_DEBUG")) {
    Vector3d q;
    std::sscanf(at, "%lf,%lf,%lf", &q[0], &q[1], &q[2]);
    RILIEVO_ASSIGN_OR_RETURN(const SharpSectors sectors, SectorsOfLevel(refinement, finest));
    int nearest_v = 0;
    double d = 1e300;
    for (int v = 0; v < top.count; ++v) {
      const double e =
          (limit.positions.col(v) + h[v] * limit.normals.col(v) - q).squaredNorm();
      if (e < d) d = e, nearest_v = v;
    }
    std::vector<int> show = {nearest_v};
    for (int j = top.begin[nearest_v]; j < top.begin[nearest_v + 1]; ++j) show.push_back(top.ring[j]);
    for (int v : show) {
      const bool is = std::find(sectors.vertices.begin(), sectors.vertices.end(), v) !=
                      sectors.vertices.end();
      std::cerr << "v " << v << (is ? " SHARP" : "") << " row " << int(top.row[v]) << " at "
                << limit.positions.col(v).transpose() << " n " << limit.normals.col(v).transpose()
                << " h " << h[v] << " s " << spacing[finest][v] << "\n";
      for (int64_t i = 0; i < count; ++i) {
        const Footprint& f = top.feet[i];
        for (int k = 0; k < 3; ++k)
          if (f.corner[k] == v) {
            double m = 0;
            for (int j = 0; j < 3; ++j) m += f.weight[j] * h[f.corner[j]];
            std::cerr << "    p " << cloud.points.col(i).transpose() << " n "
                      << cloud.normals.col(i).transpose() << " w " << f.weight[k] << " corners "
                      << f.corner[0] << " " << f.corner[1] << " " << f.corner[2] << " target "
                      << f.height << " model " << m << " a " << a[i] << " along " << f.along
                      << " h " << f.height / f.along << "\n";
          }
      }
    }
  }
  for (int v = 0; v < top.count; ++v) {
    const double s = spacing[finest][v];
    samples.measured[v] = away[v] <= reach * s;
    samples.height[v] = samples.measured[v] ? static_cast<float>(h[v]) : 0;
    samples.spacing[v] = static_cast<float>(s);
    const double t = std::exp(log_ts[finest][v]);
    samples.fitted[v] = t > 0.7;
  }
  return samples;
}

}  // namespace rilievo

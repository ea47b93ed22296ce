#include "core/displacement/plate/filter_lengths.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "core/base/status_macros.h"
#include "core/displacement/solve_settings.h"

namespace rilievo {
namespace {

// The share of a point in its own height after a filter of `length` over triangles with edges of
// `edge`, both in spacings: the mean of the response 1 / (1 + (k length)^4) over the waves that so
// many points can tell apart, those of k < 4, for the points are one to pi / 4 of the plane. Flat
// triangles filter too, as their corners take part.
double LeverageOfPlate(double length, double edge) {
  const double of_edge = kSolve.filter_of_edge * edge;
  const double widest = 16 * (length * length + of_edge * of_edge);
  return std::atan(widest) / widest;
}

// Per vertex of `level`, the share of its points that the fit of the domain took.
std::vector<double> LeverageOfDomain(const HeightProblem& problem, int level) {
  std::vector<double> share = problem.SumAt(0, [&](size_t p) { return problem.weights()[p]; });
  for (double& points : share) {
    points = kSolve.freedom_of_vertex / std::max(points, kSolve.least_points);
  }
  return Prolong(problem.refinement(), 0, level, std::move(share));
}

void AddRing(const PlateLevel& level, const std::vector<double>& of, std::vector<double>* sums) {
  for (int v = 0; v < level.vertex_count(); ++v) {
    (*sums)[v] = of[v];
    for (int s = level.begin[v]; s < level.begin[v + 1]; ++s) (*sums)[v] += of[level.neighbor[s]];
  }
}

// The coarsest level, not below `least`, whose mean edge is shorter than the filter.
int LevelFor(const HeightProblem& problem, double length, int least) {
  int level = problem.finest();
  while (level > least && problem.levels()[level - 1].mean_edge < kSolve.edge_of_length * length) {
    --level;
  }
  return level;
}

// Means over two rings of the values that are known; 0 where none is near.
std::vector<double> SmoothOverRings(const PlateLevel& level, std::vector<double> values,
                                    std::vector<double> known) {
  for (int round = 0; round < 2; ++round) {
    for (size_t v = 0; v < values.size(); ++v) values[v] *= known[v];
    const std::vector<double> before = values, known_before = known;
    AddRing(level, before, &values);
    AddRing(level, known_before, &known);
    for (size_t v = 0; v < values.size(); ++v) {
      values[v] /= std::max(known[v], 1.0);
      known[v] = known[v] > 0 ? 1 : 0;
    }
  }
  return values;
}

}  // namespace

int RegionLevel(const HeightProblem& problem) {
  const double most = static_cast<double>(problem.feet().size()) / kSolve.region_points;
  int level = 0;
  while (level < problem.finest() && problem.levels()[level + 1].vertex_count() < most) ++level;
  return level;
}

absl::StatusOr<std::vector<float>> ChooseFilterLengths(const HeightProblem& problem,
                                                       const RunContext& context) {
  const int region = RegionLevel(problem);
  const PlateLevel& regions = problem.levels()[region];
  const std::vector<double> of_domain = LeverageOfDomain(problem, region);
  std::vector<double> weight(regions.vertex_count()), risk(weight);
  AddRing(regions, problem.SumAt(region, [&](size_t p) { return problem.weights()[p]; }), &weight);
  std::vector<double> least(weight.size(), std::numeric_limits<double>::infinity());
  std::vector<double> chosen(weight.size(), 0.0), known(weight.size());
  std::transform(weight.begin(), weight.end(), known.begin(),
                 [](double w) { return w > 0 ? 1.0 : 0.0; });
  std::vector<double> lengths;
  for (double length = kSolve.shortest; length < kSolve.longest; length *= kSolve.length_ratio) {
    lengths.push_back(length);
  }
  double spacing = 0;
  for (const float s : problem.spacing()) spacing += s / problem.spacing().size();
  const double edge = problem.levels().back().mean_edge / spacing;
  // From the longest, whose heights the next ones start from.
  std::vector<double> heights;
  int level = -1;
  for (auto length = lengths.rbegin(); length != lengths.rend(); ++length) {
    const std::vector<float> same(1, static_cast<float>(*length));
    const int next = LevelFor(problem, *length * spacing, region);
    if (level < 0) {
      RILIEVO_ASSIGN_OR_RETURN(heights, problem.SolveUpTo(next, same, context));
    } else {
      heights = Prolong(problem.refinement(), level, next, std::move(heights));
      RILIEVO_RETURN_IF_ERROR(problem.Relax(next, same, kSolve.trial_steps, context, &heights));
    }
    level = next;
    RILIEVO_ASSIGN_OR_RETURN(
        const std::vector<float> residuals,
        problem.Residuals(Prolong(problem.refinement(), level, problem.finest(), heights),
                          context));
    AddRing(regions,
            problem.SumAt(region,
                          [&](size_t p) {
                            return double{problem.weights()[p]} * residuals[p] * residuals[p];
                          }),
            &risk);
    for (size_t v = 0; v < risk.size(); ++v) {
      if (!(weight[v] > 0)) continue;
      const double leverage = std::hypot(LeverageOfPlate(*length, edge), of_domain[v]);
      const double score = risk[v] / weight[v] / ((1 - leverage) * (1 - leverage));
      if (score > least[v]) continue;
      least[v] = score;
      chosen[v] = std::log(*length);
    }
  }
  const std::vector<double> logarithm =
      Prolong(problem.refinement(), region, problem.finest(),
              SmoothOverRings(regions, std::move(chosen), std::move(known)));
  std::vector<float> result(logarithm.size());
  std::transform(logarithm.begin(), logarithm.end(), result.begin(),
                 [](double l) { return static_cast<float>(std::exp(l)); });
  return result;
}

}  // namespace rilievo

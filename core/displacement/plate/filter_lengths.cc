#include "core/displacement/plate/filter_lengths.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include "core/base/status_macros.h"
#include "core/displacement/plate/settings.h"
#include "core/points/settings.h"

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

// Per vertex, the sum of the values of the points there.
std::vector<float> SumOverRegions(const std::vector<int>& region, int count,
                                  const std::function<float(size_t point)>& value) {
  std::vector<float> sums(count, 0.0f);
  for (size_t p = 0; p < region.size(); ++p) {
    if (region[p] >= 0) sums[region[p]] += value(p);
  }
  return sums;
}

// Per vertex of `level`, the share of its points that the fit of the domain took. `points`: theirs.
std::vector<float> LeverageOfDomain(const LoopRefinement& refinement, int level,
                                    std::vector<float> points) {
  std::vector<float> share = Restrict(refinement, level, 0, std::move(points));
  for (float& s : share) {
    s = static_cast<float>(kSolve.freedom_of_vertex /
                           std::max<double>(s, kCommon.fewest_witnesses));
  }
  return Prolong(refinement, 0, level, std::move(share));
}

void AddRing(const PlateLevel& level, const std::vector<float>& of, std::vector<float>* sums) {
  for (int v = 0; v < level.vertex_count(); ++v) {
    (*sums)[v] = of[v];
    for (uint32_t s = level.begin[v]; s < level.begin[v + 1]; ++s)
      (*sums)[v] += of[level.neighbor[s]];
  }
}

// The coarsest level, not below `least`, whose mean edge is shorter than the filter.
int LevelFor(const HeightProblem& problem, double length, int least) {
  int level = problem.finest();
  while (level > least && problem.levels()[level - 1].mean_edge < length) {
    --level;
  }
  return level;
}

// Means over two rings of the values that are known; 0 where none is near.
std::vector<float> SmoothOverRings(const PlateLevel& level, std::vector<float> values,
                                   std::vector<float> known) {
  for (int round = 0; round < 2; ++round) {
    for (size_t v = 0; v < values.size(); ++v) values[v] *= known[v];
    const std::vector<float> before = values, known_before = known;
    AddRing(level, before, &values);
    AddRing(level, known_before, &known);
    for (size_t v = 0; v < values.size(); ++v) {
      values[v] /= std::max(known[v], 1.0f);
      known[v] = known[v] > 0 ? 1 : 0;
    }
  }
  return values;
}

// The length of least generalised cross-validation, region by region.
class LengthChoice {
 public:
  LengthChoice(const HeightProblem& problem, int level, std::vector<int> region_of_point)
      : problem_(problem), level_(level), region_of_point_(std::move(region_of_point)) {
    const int count = regions().vertex_count();
    std::vector<float> points =
        SumOverRegions(region_of_point_, count, [&](size_t p) { return problem.weights()[p]; });
    weight_.resize(count);
    AddRing(regions(), points, &weight_);
    of_domain_ = LeverageOfDomain(problem.refinement(), level, std::move(points));
    chosen_.assign(count, 0.0f);
    least_.assign(count, std::numeric_limits<float>::infinity());
    edge_ = problem.levels().back().mean_edge / problem.MeanSpacing();
  }

  // `residuals`: of the points, after a filter of `length`.
  void Try(double length, const std::vector<float>& residuals) {
    std::vector<float> risk(weight_.size());
    AddRing(regions(),
            SumOverRegions(
                region_of_point_, regions().vertex_count(),
                [&](size_t p) { return problem_.weights()[p] * residuals[p] * residuals[p]; }),
            &risk);
    for (size_t v = 0; v < risk.size(); ++v) {
      const double leverage = LeverageAt(v, length);
      const double score = risk[v] / weight_[v] / ((1 - leverage) * (1 - leverage));
      if (!(weight_[v] > 0) || score > least_[v]) continue;
      least_[v] = static_cast<float>(score);
      chosen_[v] = static_cast<float>(std::log(length));
    }
  }

  // The lengths: a mean of logarithms over two rings of the regions with points.
  FilterLengths Chosen() const {
    std::vector<float> known(weight_.size());
    std::transform(weight_.begin(), weight_.end(), known.begin(),
                   [](float w) { return w > 0 ? 1.0f : 0.0f; });
    std::vector<float> lengths = Prolong(problem_.refinement(), level_, problem_.finest(),
                                         SmoothOverRings(regions(), chosen_, std::move(known)));
    for (float& length : lengths) length = std::exp(length);
    double sum = 0, points = 0;
    for (size_t v = 0; v < weight_.size(); ++v) {  // of the regions' level, too
      sum += weight_[v] * LeverageAt(v, lengths[v]);
      points += weight_[v];
    }
    return {std::move(lengths), points > 0 ? sum / points : 1};
  }

 private:
  double LeverageAt(size_t region, double length) const {
    return std::hypot(LeverageOfPlate(length, edge_), of_domain_[region]);
  }
  const PlateLevel& regions() const { return problem_.levels()[level_]; }

  const HeightProblem& problem_;
  int level_;
  std::vector<int> region_of_point_;
  double edge_;  // mean edge of the finest level, in spacings
  // Per region.
  std::vector<float> weight_;     // of its points and those of its ring
  std::vector<float> of_domain_;  // leverage
  std::vector<float> chosen_;     // logarithm of the best length
  std::vector<float> least_;      // score of that
};

}  // namespace

int RegionLevel(const HeightProblem& problem) {
  const double most = static_cast<double>(problem.feet().size()) / kSolve.region_points;
  int level = 0;
  while (level < problem.finest() && problem.levels()[level + 1].vertex_count() < most) ++level;
  return level;
}

absl::StatusOr<FilterLengths> ChooseFilterLengths(const HeightProblem& problem,
                                                  const RunContext& context) {
  const int region_level = RegionLevel(problem);
  RILIEVO_ASSIGN_OR_RETURN(std::vector<int> region_of_point,
                           problem.RegionOfPoints(region_level, context));
  LengthChoice choice(problem, region_level, std::move(region_of_point));
  std::vector<double> lengths;
  for (double length = kSolve.shortest; length < kSolve.longest; length *= kSolve.length_ratio) {
    lengths.push_back(length);
  }
  // From the longest, whose heights the next ones start from.
  std::vector<float> heights;
  int level = -1;
  for (auto length = lengths.rbegin(); length != lengths.rend(); ++length) {
    const std::vector<float> same(1, static_cast<float>(*length));
    const int next = LevelFor(problem, *length * problem.MeanSpacing(), region_level);
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
    choice.Try(*length, residuals);
  }
  return choice.Chosen();
}

}  // namespace rilievo

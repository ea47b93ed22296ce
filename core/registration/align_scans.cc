#include "core/registration/align_scans.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/registration/match_scans.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using Vector6d = Eigen::Matrix<double, 6, 1>;
using Vector12d = Eigen::Matrix<double, 12, 1>;
using Matrix12d = Eigen::Matrix<double, 12, 12>;

constexpr int kMostRounds = 60;
// Farthest that a point moves in a round after which nothing is gained, fraction of the diagonal.
constexpr double kStill = 3e-5;
// Points of a scan that are asked in a round. 4096 with a noise of 0.1 % tell a pose to 0.005 %.
constexpr int64_t kAskedPoints = 4096;
// Fewest matches that tell the spread of a pair.
constexpr size_t kFewestMatches = 20;
// Where Tukey's weights end, in spreads: 95 % efficiency under Gaussian noise.
constexpr double kTukey = 4.685;
// Spread, in spacings of the coarser scan, of points without noise on a curved surface.
constexpr double kSpreadOfShape = 0.1;
// Spread in that which is explained, up to which scans fit.
constexpr double kMostExcess = 3;
// Of what is known of the turns of a scan, or of its moves; holds what the matches do not.
constexpr double kDamping = 1e-6;

struct ScanPair {
  int first, second;
  double explained;  // spread, as in PairFigures, unit frame
  double reach;
};

// Normal equations of the twists of two scans, each about its centre.
struct Equations {
  Matrix12d matrix = Matrix12d::Zero();
  Vector12d right = Vector12d::Zero();
  double reach = 0;  // of the next round
};

double ExplainedSpread(const ScanSample& a, const ScanSample& b) {
  const double shape = kSpreadOfShape * std::max(a.median_spacing, b.median_spacing);
  return std::hypot(a.median_noise, b.median_noise, shape);
}

std::vector<ScanPair> AllPairs(const std::vector<ScanSample>& samples, double reach) {
  std::vector<ScanPair> pairs;
  const auto box = [&](size_t i) {
    const Eigen::Matrix3Xd& points = samples[i].points;
    return Eigen::AlignedBox3d(points.rowwise().minCoeff(), points.rowwise().maxCoeff());
  };
  for (size_t i = 0; i < samples.size(); ++i) {
    for (size_t j = i + 1; j < samples.size(); ++j) {
      if (box(i).exteriorDistance(box(j)) > reach) continue;
      pairs.push_back({static_cast<int>(i), static_cast<int>(j),
                       ExplainedSpread(samples[i], samples[j]), reach});
    }
  }
  return pairs;
}

// At most halved in a round, so that no pair settles on the few points that fit by chance.
double NextReach(const ScanPair& pair, double spread) {
  const double wanted = std::max(kTukey * spread, pair.reach / 2);
  return std::max(kTukey * pair.explained, std::min(pair.reach, wanted));
}

Equations EquationsOf(const ScanPair& pair, const std::vector<ScanSample>& samples,
                      const std::vector<Pose>& poses) {
  const ScanSample& a = samples[pair.first];
  const ScanSample& b = samples[pair.second];
  const Pose& a_pose = poses[pair.first];
  const Pose& b_pose = poses[pair.second];
  const ScanMatches found = FindMatches(a, a_pose, b, b_pose, pair.reach, kAskedPoints);
  Equations equations;
  equations.reach = pair.reach;
  if (found.matches.size() < kFewestMatches) return equations;
  const double spread = SpreadOf(found.matches);
  equations.reach = NextReach(pair, spread);
  const double scale = std::max(spread, pair.explained);
  const Vector3d a_center = a_pose * a.center, b_center = b_pose * b.center;
  for (const ScanMatch& match : found.matches) {
    const double ratio = match.Distance() / pair.reach;
    const double root = (1 - ratio * ratio) / scale;  // of Tukey's weight
    Vector12d row;
    row << (match.first - a_center).cross(match.normal), match.normal,
        -(match.second - b_center).cross(match.normal), -match.normal;
    row *= root;
    equations.matrix.noalias() += row * row.transpose();
    equations.right -= row * (root * match.Distance());
  }
  return equations;
}

// The twists of all scans, six rows each: turn, then move. The first scan of the first pair stays:
// matches do not tell where all scans are together, and the mean of two normals does not turn with
// them, so noise would.
Eigen::VectorXd Solve(size_t scans, const std::vector<ScanPair>& pairs,
                      const std::vector<Equations>& equations) {
  const auto size = static_cast<Eigen::Index>(6 * scans);
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size, size);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(size);
  for (size_t p = 0; p < pairs.size(); ++p) {
    const Eigen::Index at[] = {6 * pairs[p].first, 6 * pairs[p].second};
    for (int i = 0; i < 2; ++i) {
      right.segment<6>(at[i]) += equations[p].right.segment<6>(6 * i);
      for (int j = 0; j < 2; ++j) {
        matrix.block<6, 6>(at[i], at[j]) += equations[p].matrix.block<6, 6>(6 * i, 6 * j);
      }
    }
  }
  const Eigen::Index held = pairs.empty() ? 0 : 6 * pairs.front().first;
  matrix.middleRows<6>(held).setZero();
  matrix.middleCols<6>(held).setZero();
  right.segment<6>(held).setZero();
  for (Eigen::Index at = 0; at < size; at += 3) {
    const double known = matrix.diagonal().segment<3>(at).mean();
    matrix.diagonal().segment<3>(at).array() += known > 0 ? kDamping * known : 1;
  }
  return matrix.ldlt().solve(right);
}

// Returns how far any point of the scan moves, at most.
double Move(const Vector6d& twist, const ScanSample& sample, Pose* pose) {
  const Vector3d turn = twist.head<3>(), center = *pose * sample.center;
  const double angle = turn.norm();
  Pose move = Pose::Identity();
  if (angle > 0) move.linear() = Eigen::AngleAxisd(angle, turn / angle).toRotationMatrix();
  move.translation() = center + twist.tail<3>() - move.linear() * center;
  *pose = move * *pose;
  pose->linear() = Eigen::Quaterniond(pose->linear()).normalized().toRotationMatrix();
  return angle + twist.tail<3>().norm();
}

struct Refined {
  int rounds = 0;
  bool converged = false;
};

absl::StatusOr<Refined> Refine(const std::vector<ScanSample>& samples, const RunContext& context,
                               std::vector<ScanPair>* pairs, std::vector<Pose>* poses) {
  Refined refined;
  while (!refined.converged && refined.rounds < kMostRounds) {
    ++refined.rounds;
    std::vector<Equations> equations(pairs->size());
    RILIEVO_RETURN_IF_ERROR(ParallelFor(
        static_cast<int64_t>(pairs->size()), 1, context, [&](int64_t begin, int64_t end) {
          for (int64_t p = begin; p < end; ++p) {
            equations[p] = EquationsOf((*pairs)[p], samples, *poses);
          }
        }));
    const Eigen::VectorXd twists = Solve(samples.size(), *pairs, equations);
    double moved = 0;
    for (size_t i = 0; i < samples.size(); ++i) {
      const Vector6d twist = twists.segment<6>(static_cast<Eigen::Index>(6 * i));
      moved = std::max(moved, Move(twist, samples[i], &(*poses)[i]));
    }
    refined.converged = moved < kStill;
    for (size_t p = 0; p < pairs->size(); ++p) {
      refined.converged = refined.converged && equations[p].reach > 0.99 * (*pairs)[p].reach;
      (*pairs)[p].reach = equations[p].reach;
    }
  }
  return refined;
}

PairFigures Measure(const ScanPair& pair, const std::vector<ScanSample>& samples,
                    const std::vector<Pose>& poses, const AlignmentOptions& options) {
  const ScanMatches found =
      FindMatches(samples[pair.first], poses[pair.first], samples[pair.second], poses[pair.second],
                  pair.reach, options.sample_points);
  PairFigures figures;
  figures.first = pair.first;
  figures.second = pair.second;
  figures.overlap = std::max(found.share_of_first, found.share_of_second);
  figures.matches = static_cast<int64_t>(found.matches.size());
  for (const ScanMatch& match : found.matches) figures.rms += match.Distance() * match.Distance();
  figures.rms = std::sqrt(figures.rms / std::max(1.0, static_cast<double>(figures.matches)));
  figures.spread = SpreadOf(found.matches);
  figures.explained = pair.explained;
  figures.overlaps =
      found.matches.size() >= kFewestMatches && figures.overlap >= options.least_overlap;
  figures.fits = figures.overlaps && figures.spread <= kMostExcess * figures.explained;
  return figures;
}

// Whether two scans fit once no other holds them.
absl::StatusOr<bool> FitAlone(ScanPair pair, const std::vector<ScanSample>& samples,
                              std::vector<Pose> poses, const AlignmentOptions& options,
                              const RunContext& context) {
  std::vector<ScanPair> alone = {pair};
  RILIEVO_RETURN_IF_ERROR(Refine(samples, context, &alone, &poses).status());
  return Measure(alone[0], samples, poses, options).fits;
}

std::vector<int> GroupsOf(size_t scans, const std::vector<PairFigures>& pairs) {
  std::vector<int> group(scans);
  std::iota(group.begin(), group.end(), 0);
  for (const PairFigures& pair : pairs) {
    if (!pair.overlaps) continue;
    const auto [kept, gone] = std::minmax(group[pair.first], group[pair.second]);
    std::replace(group.begin(), group.end(), int{gone}, int{kept});
  }
  return group;
}

// A move of the unit frame as one of the scans, after which the first scan is where it was.
Eigen::Isometry3d ScanMove(const Pose& pose, const Pose& first, const SpatialFrame& frame) {
  const Pose unit = first.inverse() * pose;
  Eigen::Isometry3d move = Eigen::Isometry3d::Identity();
  move.linear() = unit.linear();
  move.translation() =
      frame.center - unit.linear() * frame.center + frame.diagonal * unit.translation();
  return move;
}

}  // namespace

absl::Status AlignmentOptions::Validate() const {
  const auto check = [](const char* field, double value, double low, double high) -> absl::Status {
    if (value >= low && value <= high) return absl::OkStatus();
    return absl::InvalidArgumentError(absl::StrCat("alignment.", field, " is ", value,
                                                   "; it must lie in [", low, ", ", high, "]"));
  };
  RILIEVO_RETURN_IF_ERROR(check("reach", reach, 1e-6, 0.5));
  RILIEVO_RETURN_IF_ERROR(check("least_overlap", least_overlap, 0.01, 1));
  return check("sample_points", sample_points, 1000, 1e6);
}

bool Alignment::IsSound() const {
  return std::all_of(group.begin(), group.end(), [](int number) { return number == 0; }) &&
         std::all_of(pairs.begin(), pairs.end(),
                     [](const PairFigures& pair) { return pair.fits || !pair.overlaps; });
}

absl::StatusOr<Alignment> AlignScans(std::span<const PointCloud> scans,
                                     const AlignmentOptions& options, const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  if (scans.size() < 2) {
    return absl::InvalidArgumentError(
        absl::StrCat("scans: ", scans.size(), "; at least two are needed to align them"));
  }
  RILIEVO_ASSIGN_OR_RETURN(const SampledScans sampled,
                           SampleScans(scans, options.sample_points, context));
  const std::vector<ScanSample>& samples = sampled.samples;
  std::vector<ScanPair> pairs = AllPairs(samples, options.reach);
  std::vector<Pose> poses(scans.size(), Pose::Identity());
  RILIEVO_ASSIGN_OR_RETURN(const Refined refined, Refine(samples, context, &pairs, &poses));
  Alignment alignment;
  alignment.diagonal = sampled.frame.diagonal;
  alignment.rounds = refined.rounds;
  alignment.converged = refined.converged;
  for (const ScanPair& pair : pairs) {
    PairFigures figures = Measure(pair, samples, poses, options);
    if (figures.matches == 0) continue;
    if (figures.overlaps && !figures.fits) {
      RILIEVO_ASSIGN_OR_RETURN(figures.fits_alone,
                               FitAlone(pair, samples, poses, options, context));
    }
    for (double* length : {&figures.rms, &figures.spread, &figures.explained}) {
      *length *= alignment.diagonal;
    }
    alignment.pairs.push_back(figures);
  }
  alignment.group = GroupsOf(scans.size(), alignment.pairs);
  for (const Pose& pose : poses) {
    alignment.moves.push_back(ScanMove(pose, poses[0], sampled.frame));
  }
  return alignment;
}

void MoveCloud(const Eigen::Isometry3d& move, PointCloud* cloud) {
  cloud->points = move * cloud->points;
  cloud->sights.stations = move * cloud->sights.stations;
  cloud->sights.normals = move.linear().cast<float>() * cloud->sights.normals;
}

}  // namespace rilievo

#include "core/codec/heights/height_encoder.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/base/status_macros.h"
#include "core/codec/bytes/range_coder.h"
#include "core/codec/heights/height_encoder_pass.h"
#include "core/codec/heights/holes.h"

namespace rilievo {
namespace {

// Rounds of quantisation, and how much of what is wrong after one is put right in the next: the
// basis functions overlap, so the whole would be too much. Fine steps beside filled heights take
// more rounds to get below this share of the step.
constexpr int kRounds = 3, kMostRounds = 8;
constexpr double kEnough = 0.35;
constexpr double kCorrection = 0.75;
// Where kCorrection goes farther than so many times the step of least error before quantisation,
// that step is taken instead: a scan of a million points takes 41 336 bytes, not 46 945 with rounds
// that diverge. That step everywhere takes 0.8 % more bytes: small changes vanish in dead zones.
constexpr double kFarBeyond = 1.5;
// A coefficient over little measured surface counts as having this share of the level's mean gain.
constexpr double kLeastGainShare = 0.4;

std::vector<uint8_t> FilledFlags(const DisplacedSurface& surface) {
  std::vector<uint8_t> filled;
  filled.reserve(surface.sources.size());
  for (HeightSource source : surface.sources) filled.push_back(source == HeightSource::kFilled);
  return filled;
}

// By vertex of level `max_level`; the refinement reaches the level before.
std::vector<uint8_t> BorderVertices(const LoopRefinement& refinement, int max_level) {
  const MeshTopology& last = refinement.levels[std::max(0, max_level - 1)];
  std::vector<uint8_t> on_border = last.boundary_vertex;
  for (int e = 0; max_level > 0 && e < last.edge_count(); ++e) {
    on_border.push_back(last.edge_faces(1, e) < 0 ? 1 : 0);
  }
  return on_border;
}

}  // namespace

int64_t EncodedHeights::bytes() const {
  int64_t sum = 0;
  for (const auto& layer : layers) sum += static_cast<int64_t>(layer.size());
  return sum;
}

HeightEncoder::~HeightEncoder() = default;

HeightEncoder::HeightEncoder(const DisplacedSurface& surface, const LoopRefinement& refinement,
                             int smallest_hole, const FaceGroups* groups, const HeightPlan* plan,
                             bool keep_zero_border)
    : refinement_(refinement),
      groups_(groups),
      max_level_(surface.max_level),
      heights_(surface.heights),
      rings_(RingsIntoHoles(refinement, surface.max_level, kRimRings, FilledFlags(surface))),
      filled_(FilledFlags(surface)),
      lifting_(refinement, surface.max_level),
      weights_(HeightWeights(surface.control_mesh, refinement, surface.max_level, rings_,
                             plan != nullptr ? plan->mean_weight : 0)) {
  // Small holes cost no flags; their heights are filled ones all the same.
  DropSmallHoles(refinement, max_level_, smallest_hole, filled_);
  has_filled_ = plan != nullptr ? plan->has_filled
                                : std::find(filled_.begin(), filled_.end(), 1) != filled_.end();
  targets_.assign(heights_.begin(), heights_.end());
  const bool planned = plan != nullptr && plan->chosen();
  if (planned) {
    lifting_.set_steps(plan->lifting);
    lifting_.Analyze(targets_);
  } else {
    // Without an update heights are samples, and those on the border follow from each other.
    if (keep_zero_border) lifting_.set_strength(0);
    detail_sums_ = lifting_.AnalyzeAndChoose(weights_, targets_);
  }
  if (keep_zero_border) {
    const std::vector<uint8_t> on_border = BorderVertices(refinement, max_level_);
    for (size_t v = 0; v < heights_.size(); ++v) {
      if (on_border[v] != 0 && heights_[v] == 0) zeros_.push_back(static_cast<int>(v));
    }
  }
  if (*std::max_element(rings_.begin(), rings_.end()) > kRimRings) FreeInnerHeights();
  if (planned) {
    gains_ = GainsOf(plan->level_gains, lifting_, refinement_, weights_);
    mean_gains_ = plan->mean_gains;
    return;
  }
  gains_ = GainsOf(lifting_, refinement_, weights_);
  for (int l = 0; l <= max_level_; ++l) {
    double sum = 0;
    int count = 0;
    for (int v = lifting_.begin(l); v < lifting_.end(l); ++v) {
      if (filled_[v] != 0) continue;
      sum += gains_.of_vertex[v];
      ++count;
    }
    mean_gains_.push_back(count > 0 ? sum / count : 0);
    coded_counts_.push_back(count);
  }
}

// Filled heights far from told ones are free: they take the values that need no coefficients, and
// the targets of the others follow.
void HeightEncoder::FreeInnerHeights() {
  constexpr int kFreeRounds = 4;
  for (int round = 0; round < kFreeRounds; ++round) {
    for (int l = 1; l <= max_level_; ++l) {
      for (int v = lifting_.begin(l); v < lifting_.end(l); ++v) {
        if (IsFree(v)) targets_[v] = 0;
      }
    }
    lifting_.Synthesize(targets_);
    for (size_t v = 0; v < targets_.size(); ++v) {
      if (!IsFree(v)) targets_[v] = heights_[v];
    }
    lifting_.Analyze(targets_);
  }
}

double HeightEncoder::ErrorAt(size_t v, const Pass& pass) const {
  return heights_[v] - pass.state.heights[v] * pass.unit;
}

// What is still wrong is told by the basis functions of each coefficient: they are not quite
// orthogonal, so errors of one can be mended by others, in a step of steepest descent that is
// preconditioned by the gains.
std::vector<double> HeightEncoder::CorrectedTargets(const Pass& pass) const {
  std::vector<double> change(heights_.size());
  for (size_t v = 0; v < change.size(); ++v) change[v] = weights_[v] * ErrorAt(v, pass);
  lifting_.Adjoint(change);
  for (int l = 0; l <= max_level_; ++l) {
    const double least = kLeastGainShare * mean_gains_[l];
    for (int v = lifting_.begin(l); v < lifting_.end(l); ++v) {
      const double gain = std::max(gains_.of_vertex[v], least);
      change[v] = gain > 0 ? change[v] / gain : 0;
    }
  }
  DropFixed(pass, change);
  const double share = ShareOfChange(pass, change);
  for (size_t v = 0; v < change.size(); ++v) {
    change[v] = pass.coefficients[v] * pass.unit + share * change[v];
  }
  for (const int v : zeros_) change[v] = 0;
  return change;
}

// The coefficients that a next round cannot change.
void HeightEncoder::DropFixed(const Pass& pass, std::vector<double>& change) const {
  for (const int v : zeros_) change[v] = 0;
  if (pass.shared == nullptr) return;
  std::fill_n(change.begin(), lifting_.end(kFirstGroupedLevel - 1), 0.0);
}

// How much of `change` to add to the coefficients. Where large faces lie beside small ones many
// basis functions overlap, and kCorrection diverges. One number for all of the surface, or for
// a part that is coded apart.
double HeightEncoder::ShareOfChange(const Pass& pass, const std::vector<double>& change) const {
  std::vector<double> heights_change = change;
  lifting_.Synthesize(heights_change);
  double along = 0, squared = 0;
  for (size_t v = 0; v < heights_change.size(); ++v) {
    along += weights_[v] * ErrorAt(v, pass) * heights_change[v];
    squared += weights_[v] * heights_change[v] * heights_change[v];
  }
  return kCorrection * squared <= kFarBeyond * along ? kCorrection : along / squared;
}

HeightSums HeightEncoder::SumsOf(const Pass& pass) const {
  HeightSums sums;
  for (size_t v = 0; v < heights_.size(); ++v) {
    if (!IsTold(v) || (!counted_.empty() && counted_[v] == 0)) continue;
    const double error = ErrorAt(v, pass);
    sums.squared += weights_[v] * error * error;
    sums.weight += weights_[v];
    sums.max = std::max(sums.max, std::abs(error));
  }
  return sums;
}

EncodedHeights HeightEncoder::Finish(double step, const Pass& pass) const {
  EncodedHeights encoded;
  encoded.step = step;
  encoded.unit = pass.unit;
  encoded.layers = pass.layers;
  const HeightSums sums = SumsOf(pass);
  encoded.max = sums.max;
  encoded.rms = sums.rms();
  return encoded;
}

// `pass`: as the round before left it.
template <typename Coder>
absl::Status HeightEncoder::RunRound(int round, double step, const RunContext& context,
                                     Pass& pass) const {
  RILIEVO_RETURN_IF_ERROR(context.CheckStop());
  return RunPass<Coder>(step, round > 0 ? CorrectedTargets(pass) : targets_, context, pass);
}

absl::StatusOr<EncodedHeights> HeightEncoder::Encode(double step, const RunContext& context) const {
  Pass pass;
  EncodedHeights encoded;
  for (int round = 0; round < kMostRounds; ++round) {
    if (round + 1 < kRounds) {
      RILIEVO_RETURN_IF_ERROR(RunRound<NoBytes>(round, step, context, pass));
      continue;
    }
    RILIEVO_RETURN_IF_ERROR(RunRound<RangeEncoder>(round, step, context, pass));
    EncodedHeights next = Finish(step, pass);
    if (round + 1 > kRounds && next.rms >= encoded.rms) break;
    encoded = std::move(next);
    if (encoded.rms < kEnough * step) break;
  }
  return encoded;
}

absl::StatusOr<std::vector<double>> HeightEncoder::RmsOfRounds(double step, int rounds,
                                                               const RunContext& context) const {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<HeightSums> sums,
                           SumsOfRounds(step, rounds, context, nullptr));
  std::vector<double> rms;
  for (const HeightSums& of_round : sums) rms.push_back(of_round.rms());
  return rms;
}

absl::StatusOr<std::vector<HeightSums>> HeightEncoder::SumsOfRounds(
    double step, int rounds, const RunContext& context, std::vector<double>* corrected) const {
  Pass pass;
  std::vector<HeightSums> sums;
  for (int round = 0; round < rounds; ++round) {
    RILIEVO_RETURN_IF_ERROR(RunRound<NoBytes>(round, step, context, pass));
    sums.push_back(SumsOf(pass));
  }
  if (corrected != nullptr) *corrected = CorrectedTargets(pass);
  return sums;
}

absl::StatusOr<GroupPieces> HeightEncoder::EncodeGroups(const SharedHeights& shared, double step,
                                                        const RunContext& context) const {
  Pass pass;
  pass.shared = &shared;
  GroupPieces made;
  for (int round = 0; round < kMostRounds; ++round) {
    if (round + 1 < kRounds) {
      RILIEVO_RETURN_IF_ERROR(RunRound<NoBytes>(round, step, context, pass));
    } else {
      RILIEVO_RETURN_IF_ERROR(RunRound<RangeEncoder>(round, step, context, pass));
    }
    if (!pass.fits) return GroupPieces{{}, {}, false};
    if (round + 1 < kRounds) continue;
    const HeightSums sums = SumsOf(pass);
    if (round + 1 > kRounds && sums.rms() >= made.sums.rms()) break;
    made = {std::move(pass.pieces), sums, true};
    if (sums.rms() < kEnough * step) break;
  }
  return made;
}

}  // namespace rilievo

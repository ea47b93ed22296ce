#include "core/codec/heights/height_encoder.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/range_coder.h"
#include "core/codec/heights/group_heights.h"
#include "core/codec/heights/height_encoder_draw.h"
#include "core/codec/heights/height_encoder_unit.h"
#include "core/codec/heights/height_range.h"
#include "core/codec/heights/holes.h"
#include "core/codec/heights/rate_distortion_chooser.h"

namespace rilievo {
namespace {

// Bits are worth this many squared steps. At high rates an error of step^2 / 12 falls by
// step^2 ln 2 / 6 = 0.1155 step^2 with one more bit.
constexpr double kLambda = 0.11;

// Rounds of quantisation, and how much of what is wrong after one is put right in the next: the
// basis functions overlap, so the whole would be too much. Fine steps beside filled heights take
// more rounds to get below this share of the step.
constexpr int kRounds = 3, kMostRounds = 8;
constexpr double kEnough = 0.35;
constexpr double kCorrection = 0.75;
// A coefficient over little measured surface counts as having this share of the level's mean gain.
constexpr double kLeastGainShare = 0.4;

std::vector<uint8_t> FilledFlags(const DisplacedSurface& surface) {
  std::vector<uint8_t> filled;
  filled.reserve(surface.sources.size());
  for (HeightSource source : surface.sources) filled.push_back(source == HeightSource::kFilled);
  return filled;
}

}  // namespace

int64_t EncodedHeights::bytes() const {
  int64_t sum = 0;
  for (const auto& layer : layers) sum += static_cast<int64_t>(layer.size());
  return sum;
}

// One run over all levels.
struct HeightEncoder::Pass {
  double unit = 0;
  double least_unit = 0;                  // a smaller one did not hold the heights
  std::atomic<bool> fits = true;          // no height beyond the range of the format so far
  std::vector<Dequantizer> dequantizers;  // per level
  HeightState state;
  std::vector<int32_t> coefficients;  // as decoded, in units
  std::vector<std::vector<uint8_t>> layers;
  // Of each group: dequantizer draws and pieces of level kFirstGroupedLevel and on.
  std::vector<std::vector<std::array<int, 2>>> draws;
  std::vector<std::vector<std::vector<uint8_t>>> pieces;
};

// Part of the whole, with where its vertices are there.
struct HeightEncoder::Group {
  GroupMesh mesh;
  std::vector<int> whole_vertex;  // of the finest level
};

HeightEncoder::~HeightEncoder() = default;

HeightEncoder::HeightEncoder(const DisplacedSurface& surface, const LoopRefinement& refinement,
                             int smallest_hole)
    : refinement_(refinement),
      max_level_(surface.max_level),
      heights_(surface.heights.begin(), surface.heights.end()),
      rings_(RingsIntoHoles(refinement, surface.max_level, kRimRings, FilledFlags(surface))),
      filled_(FilledFlags(surface)),
      lifting_(refinement, surface.max_level),
      weights_(HeightWeights(surface.control_mesh, refinement, surface.max_level, rings_)) {
  // Small holes cost no flags; their heights are filled ones all the same.
  DropSmallHoles(refinement, max_level_, smallest_hole, filled_);
  has_filled_ = std::find(filled_.begin(), filled_.end(), 1) != filled_.end();
  targets_ = heights_;
  lifting_.AnalyzeAndChoose(weights_, targets_);
  if (*std::max_element(rings_.begin(), rings_.end()) > kRimRings) FreeInnerHeights();
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
  }
}

absl::StatusOr<std::unique_ptr<HeightEncoder>> HeightEncoder::MakeGrouped(
    const DisplacedSurface& surface, const LoopRefinement& refinement, int smallest_hole,
    const FaceGroups& groups, const RunContext& context) {
  auto encoder = std::make_unique<HeightEncoder>(surface, refinement, smallest_hole);
  RILIEVO_RETURN_IF_ERROR(encoder->BuildGroups(groups, context));
  return encoder;
}

absl::Status HeightEncoder::BuildGroups(const FaceGroups& groups, const RunContext& context) {
  groups_ = &groups;
  if (!grouped()) return absl::OkStatus();
  const MeshTopology& control = refinement_.levels[0];
  const FaceVertices whole(control, max_level_);
  RunContext one_thread = context;
  one_thread.threads = 1;
  one_thread.progress = nullptr;
  for (int g = 0; g < groups.count(); ++g) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    Group group;
    RILIEVO_ASSIGN_OR_RETURN(group.mesh,
                             BuildGroupMesh(control, groups, g, max_level_, one_thread));
    group.whole_vertex = VerticesThere(FaceVertices(group.mesh.refinement.levels[0], max_level_),
                                       whole, groups.members[g]);
    group_meshes_.push_back(std::move(group));
  }
  return absl::OkStatus();
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

std::vector<double> HeightEncoder::StepsOfLevels(double step) const {
  const double finest = gains_.of_level.back();
  std::vector<double> steps;
  for (double gain : gains_.of_level) {
    steps.push_back(gain > 0 && finest > 0 ? step * std::sqrt(finest / gain) : step);
  }
  return steps;
}

template <typename Coder>
void HeightEncoder::CodeLevel(int level, const std::vector<double>& targets_in_units,
                              HeightModels& models, Pass& pass) const {
  Dequantizer& dequantizer = pass.dequantizers[level];
  const int begin = lifting_.begin(level), end = lifting_.end(level);
  Coder coder;
  RateDistortionChooser chooser(refinement_, level, dequantizer, kLambda, targets_in_units,
                                gains_.of_vertex, mean_gains_[level]);
  LevelCoder<Coder, RateDistortionChooser> coded(coder, chooser, refinement_, level,
                                                 dequantizer.step, has_filled_, models, pass.state);
  HeightLayout layout;
  layout.empty = chooser.Empty(begin, end);
  const bool coefficients_fit = coded.Run(layout.empty);
  // The choice was made with the draw of the round before; the bytes say the one that fits best.
  dequantizer.draw =
      MeanDraw(targets_in_units, pass.state.coefficients, begin, end, dequantizer.step);
  layout.dequantizer = dequantizer;
  layout.lifting = level > 0 ? lifting_.step(level) : LiftingStep{0, 0};
  std::vector<uint8_t> payload = WriteHeightLayout(layout);
  const std::vector<uint8_t> bits = coder.Finish();
  payload.insert(payload.end(), bits.begin(), bits.end());
  pass.layers.push_back(std::move(payload));
  std::vector<int32_t>& heights = pass.state.heights;
  pass.fits = coefficients_fit && AddValues(dequantizer, pass.state.coefficients, heights);
  if (!pass.fits) return;
  pass.coefficients.insert(pass.coefficients.end(), heights.begin() + begin, heights.end());
  if (level > 0) SynthesizeLevel(refinement_.levels[level - 1], layout.lifting, heights);
  pass.fits = InHeightRange(heights);
}

// Writes at places of the pass that are this group's own.
template <typename Coder>
void HeightEncoder::CodeGroup(const Group& group, const std::vector<double>& targets_in_units,
                              const HeightModels& shared_models, Pass& pass) const {
  const GroupMesh& mesh = group.mesh;
  const std::vector<int>& whole = group.whole_vertex;
  const auto gathered = [&](const auto& values, auto foreign) {
    std::vector<decltype(foreign)> own;
    own.reserve(whole.size());
    for (size_t v = 0; v < whole.size(); ++v) {
      own.push_back(mesh.foreign[v] != 0 ? foreign : values[whole[v]]);
    }
    return own;
  };
  const std::vector<double> targets = gathered(targets_in_units, 0.0);
  const std::vector<double> gains = gathered(gains_.of_vertex, 0.0);
  const auto models = std::make_unique<HeightModels>(shared_models);
  const int shared_count = mesh.refinement.vertex_count(kFirstGroupedLevel - 1);
  HeightState state = StateOfGroup(pass.state, groups_->members[mesh.group],
                                   std::vector<int>(whole.begin(), whole.begin() + shared_count));
  state.filled = gathered(filled_, uint8_t{0});
  std::vector<int32_t> values(shared_count, 0);
  for (int level = kFirstGroupedLevel; level <= max_level_; ++level) {
    Dequantizer dequantizer = pass.dequantizers[level];
    std::array<int, 2>& draw = pass.draws[mesh.group][level - kFirstGroupedLevel];
    std::vector<uint8_t>& piece = pass.pieces[mesh.group][level - kFirstGroupedLevel];
    dequantizer.draw = draw;
    const int begin = mesh.refinement.vertex_count(level - 1);
    const int end = mesh.refinement.vertex_count(level);
    Coder coder;
    RateDistortionChooser chooser(mesh.refinement, level, dequantizer, kLambda, targets, gains,
                                  mean_gains_[level]);
    PieceLayout layout;
    layout.empty = chooser.Empty(begin, end);
    const bool any_filled = std::any_of(state.filled.begin() + begin, state.filled.begin() + end,
                                        [](uint8_t filled) { return filled != 0; });
    piece.clear();
    bool fits = true;
    if (layout.empty && !any_filled) {
      state.coefficients.resize(end, 0);
      state.active = NoneActive(mesh.refinement, level);
    } else {
      LevelCoder<Coder, RateDistortionChooser> coded(coder, chooser, mesh.refinement, level,
                                                     dequantizer.step, has_filled_, *models, state,
                                                     mesh.foreign.data());
      fits = coded.Run(layout.empty);
      draw = MeanDraw(targets, state.coefficients, begin, end, dequantizer.step);
      layout.draw = dequantizer.draw = draw;
      piece = WritePieceLayout(layout);
      const std::vector<uint8_t> bits = coder.Finish();
      piece.insert(piece.end(), bits.begin(), bits.end());
    }
    fits = fits && AddValues(dequantizer, state.coefficients, values);
    if (fits && level < max_level_) {
      state.heights.insert(state.heights.end(), values.begin() + begin, values.end());
      SynthesizeLevel(mesh.refinement.levels[level - 1], lifting_.step(level), state.heights);
      fits = InHeightRange(state.heights);
    }
    if (!fits) {
      pass.fits = false;
      return;
    }
  }
  for (size_t v = shared_count; v < whole.size(); ++v) {
    if (mesh.foreign[v] == 0) pass.coefficients[whole[v]] = values[v];
  }
}

template <typename Coder>
absl::Status HeightEncoder::CodeGroups(const std::vector<double>& targets_in_units,
                                       const HeightModels& models, const RunContext& context,
                                       Pass& pass) const {
  const size_t levels = static_cast<size_t>(max_level_ - kFirstGroupedLevel + 1);
  pass.draws.resize(group_meshes_.size());
  for (auto& draws : pass.draws) draws.resize(levels);
  pass.pieces.assign(group_meshes_.size(), std::vector<std::vector<uint8_t>>(levels));
  pass.coefficients.resize(lifting_.end(max_level_), 0);
  RILIEVO_RETURN_IF_ERROR(ParallelFor(
      static_cast<int64_t>(group_meshes_.size()), 1, context, [&](int64_t begin, int64_t end) {
        for (int64_t g = begin; g < end; ++g) {
          CodeGroup<Coder>(group_meshes_[g], targets_in_units, models, pass);
        }
      }));
  if (!pass.fits) return absl::OkStatus();
  std::vector<int32_t>& heights = pass.state.heights;
  heights.insert(heights.end(),
                 pass.coefficients.begin() + static_cast<std::ptrdiff_t>(heights.size()),
                 pass.coefficients.end());
  for (int level = kFirstGroupedLevel; level <= max_level_; ++level) {
    SynthesizeLevel(refinement_.levels[level - 1], lifting_.step(level),
                    std::span(heights).first(static_cast<size_t>(lifting_.end(level))));
    pass.fits = pass.fits && InHeightRange(std::span(heights).first(lifting_.end(level)));
    if (!pass.fits) return absl::OkStatus();
    std::vector<std::vector<uint8_t>> pieces;
    for (auto& of_group : pass.pieces) {
      pieces.push_back(std::move(of_group[level - kFirstGroupedLevel]));
    }
    pass.layers.push_back(
        WriteGroupedLayout(lifting_.step(level), pass.dequantizers[level].step, pieces));
  }
  return absl::OkStatus();
}

template <typename Coder>
absl::Status HeightEncoder::RunPass(double step, const std::vector<double>& targets,
                                    const RunContext& context, Pass& pass) const {
  const std::vector<double> steps = StepsOfLevels(step);
  pass.unit = UnitOfHeights(steps, heights_, targets, pass.least_unit);
  RILIEVO_RETURN_IF_ERROR(CodeInUnits<Coder>(steps, targets, context, pass));
  while (!pass.fits) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    pass.unit = pass.least_unit = WiderUnit(pass.unit);
    RILIEVO_RETURN_IF_ERROR(CodeInUnits<Coder>(steps, targets, context, pass));
  }
  return absl::OkStatus();
}

// All levels in the pass's unit, up to the first that does not fit in it.
template <typename Coder>
absl::Status HeightEncoder::CodeInUnits(const std::vector<double>& steps,
                                        const std::vector<double>& targets,
                                        const RunContext& context, Pass& pass) const {
  pass.dequantizers.resize(max_level_ + 1);
  std::vector<double> in_units = targets;
  for (double& target : in_units) target /= pass.unit;
  pass.fits = true;
  pass.state = HeightState();
  pass.state.filled = filled_;
  pass.coefficients.clear();
  pass.layers.clear();
  const auto models = std::make_unique<HeightModels>();
  for (int l = 0; l <= max_level_ && pass.fits; ++l) {
    const double units = std::clamp(std::round(steps[l] / pass.unit), 1.0, double{kMaxHeightStep});
    pass.dequantizers[l].step = static_cast<int32_t>(units);
    if (!grouped() || l < kFirstGroupedLevel) CodeLevel<Coder>(l, in_units, *models, pass);
  }
  if (!grouped() || !pass.fits) return absl::OkStatus();
  return CodeGroups<Coder>(in_units, *models, context, pass);
}

// What is still wrong is told by the basis functions of each coefficient: they are not quite
// orthogonal, so errors of one can be mended by others.
std::vector<double> HeightEncoder::CorrectedTargets(const Pass& pass) const {
  std::vector<double> error(heights_.size());
  for (size_t v = 0; v < error.size(); ++v) {
    error[v] = weights_[v] * (heights_[v] - pass.state.heights[v] * pass.unit);
  }
  lifting_.Adjoint(error);
  for (int l = 0; l <= max_level_; ++l) {
    const double least = kLeastGainShare * mean_gains_[l];
    for (int v = lifting_.begin(l); v < lifting_.end(l); ++v) {
      const double gain = std::max(gains_.of_vertex[v], least);
      const double change = gain > 0 ? kCorrection * error[v] / gain : 0;
      error[v] = pass.coefficients[v] * pass.unit + change;
    }
  }
  return error;
}

EncodedHeights HeightEncoder::Finish(double step, const Pass& pass) const {
  EncodedHeights encoded;
  encoded.step = step;
  encoded.unit = pass.unit;
  encoded.layers = pass.layers;
  double sum = 0, told = 0;
  for (size_t v = 0; v < heights_.size(); ++v) {
    if (!IsTold(v)) continue;
    const double error = heights_[v] - pass.state.heights[v] * pass.unit;
    sum += weights_[v] * error * error;
    told += weights_[v];
    encoded.max = std::max(encoded.max, std::abs(error));
  }
  encoded.rms = told > 0 ? std::sqrt(sum / told) : 0;
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
  Pass pass;
  std::vector<double> rms;
  for (int round = 0; round < rounds; ++round) {
    RILIEVO_RETURN_IF_ERROR(RunRound<NoBytes>(round, step, context, pass));
    rms.push_back(Finish(step, pass).rms);
  }
  return rms;
}

}  // namespace rilievo

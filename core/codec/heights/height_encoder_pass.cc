#include "core/codec/heights/height_encoder_pass.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <span>
#include <utility>

#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/range_coder.h"
#include "core/codec/heights/group_heights.h"
#include "core/codec/heights/height_encoder_level.h"
#include "core/codec/heights/height_encoder_unit.h"
#include "core/codec/mesh/face_groups.h"

namespace rilievo {

template <typename Coder>
void HeightEncoder::CodeLevel(int level, const std::vector<double>& targets_in_units,
                              HeightModels& models, Pass& pass) const {
  pass.fits = CodeLevelOfWhole<Coder>(
      refinement_, level, level > 0 ? lifting_.step(level) : LiftingStep{0, 0},
      {targets_in_units, gains_.of_vertex, mean_gains_[level]}, has_filled_,
      pass.dequantizers[level], models, pass.state, pass.coefficients, &pass.layers.emplace_back());
}

// Writes at places of the pass that are this group's own.
template <typename Coder>
absl::Status HeightEncoder::CodeGroup(int group, const FaceVertices& vertices_of_whole,
                                      const std::vector<double>& targets_in_units,
                                      const HeightModels& shared_models, const RunContext& context,
                                      Pass& pass) const {
  const MeshTopology& control = refinement_.levels[0];
  RILIEVO_ASSIGN_OR_RETURN(const GroupMesh mesh,
                           BuildGroupMesh(control, *groups_, group, max_level_, context));
  const std::vector<int> whole = VerticesThere(FaceVertices(mesh.refinement.levels[0], max_level_),
                                               vertices_of_whole, groups_->members[group]);
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
  HeightState state = StateOfGroup(pass.state, groups_->members[group],
                                   std::vector<int>(whole.begin(), whole.begin() + shared_count));
  state.filled = gathered(pass.state.filled, uint8_t{0});
  std::vector<int32_t> values(shared_count, 0);
  for (int level = kFirstGroupedLevel; level <= max_level_; ++level) {
    Dequantizer dequantizer = pass.dequantizers[level];
    std::array<int, 2>& draw = pass.draws[group][level - kFirstGroupedLevel];
    std::vector<uint8_t>& piece = pass.pieces[group][level - kFirstGroupedLevel];
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
      return absl::OkStatus();
    }
  }
  for (size_t v = shared_count; v < whole.size(); ++v) {
    if (mesh.foreign[v] == 0) pass.coefficients[whole[v]] = values[v];
  }
  return absl::OkStatus();
}

template <typename Coder>
absl::Status HeightEncoder::CodeGroups(const std::vector<double>& targets_in_units,
                                       const HeightModels& models, const RunContext& context,
                                       Pass& pass) const {
  const size_t levels = static_cast<size_t>(max_level_ - kFirstGroupedLevel + 1);
  const auto count = static_cast<size_t>(groups_->count());
  pass.draws.resize(count);
  for (auto& draws : pass.draws) draws.resize(levels);
  pass.pieces.assign(count, std::vector<std::vector<uint8_t>>(levels));
  pass.coefficients.resize(lifting_.end(max_level_), 0);
  const FaceVertices vertices_of_whole(refinement_.levels[0], max_level_);
  RunContext one_thread = context;
  one_thread.threads = 1;
  one_thread.progress = nullptr;
  std::vector<absl::Status> coded(count);
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(groups_->count(), 1, context, [&](int64_t begin, int64_t end) {
        for (int64_t g = begin; g < end; ++g) {
          coded[g] = CodeGroup<Coder>(static_cast<int>(g), vertices_of_whole, targets_in_units,
                                      models, one_thread, pass);
        }
      }));
  for (const absl::Status& of_group : coded) RILIEVO_RETURN_IF_ERROR(of_group);
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
    if (pass.shared != nullptr) continue;  // the pieces go to the whole
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
absl::Status HeightEncoder::RunPass(double step, std::vector<double> targets,
                                    const RunContext& context, Pass& pass) const {
  const std::vector<double> steps = StepsOfLevels(step, gains_.of_level);
  const auto divide = [&](double unit) {
    for (double& target : targets) target /= unit;
  };
  if (pass.shared != nullptr) {
    pass.unit = pass.shared->unit;
    divide(pass.unit);
    return CodeInUnits<Coder>(steps, targets, context, pass);
  }
  pass.unit = UnitOfHeights(steps, Farthest(heights_), Farthest(targets), pass.least_unit);
  divide(pass.unit);
  RILIEVO_RETURN_IF_ERROR(CodeInUnits<Coder>(steps, targets, context, pass));
  while (!pass.fits) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const double wider = WiderUnit(pass.unit);
    divide(wider / pass.unit);
    pass.unit = pass.least_unit = wider;
    RILIEVO_RETURN_IF_ERROR(CodeInUnits<Coder>(steps, targets, context, pass));
  }
  return absl::OkStatus();
}

// What the shared levels leave, and their models.
std::unique_ptr<HeightModels> HeightEncoder::TakeShared(Pass& pass) {
  const SharedHeights& shared = *pass.shared;
  pass.state.heights = shared.state.heights;
  pass.state.coefficients = shared.state.coefficients;
  std::copy(shared.state.filled.begin(), shared.state.filled.end(), pass.state.filled.begin());
  pass.state.active = shared.state.active;
  pass.coefficients = shared.values;
  return std::make_unique<HeightModels>(shared.models);
}

// All levels in the pass's unit, up to the first that does not fit in it.
template <typename Coder>
absl::Status HeightEncoder::CodeInUnits(const std::vector<double>& steps,
                                        const std::vector<double>& targets_in_units,
                                        const RunContext& context, Pass& pass) const {
  pass.dequantizers.resize(max_level_ + 1);
  pass.fits = true;
  pass.state = HeightState();
  pass.state.filled = filled_;
  pass.coefficients.clear();
  pass.layers.clear();
  const auto models = pass.shared != nullptr ? TakeShared(pass) : std::make_unique<HeightModels>();
  for (int l = 0; l <= max_level_ && pass.fits; ++l) {
    pass.dequantizers[l].step = StepInUnits(steps[l], pass.unit);
    const bool here = pass.shared == nullptr && (!grouped() || l < kFirstGroupedLevel);
    if (here) CodeLevel<Coder>(l, targets_in_units, *models, pass);
  }
  if (!grouped() || !pass.fits) return absl::OkStatus();
  return CodeGroups<Coder>(targets_in_units, *models, context, pass);
}

template absl::Status HeightEncoder::RunPass<NoBytes>(double, std::vector<double>,
                                                      const RunContext&, Pass&) const;
template absl::Status HeightEncoder::RunPass<RangeEncoder>(double, std::vector<double>,
                                                           const RunContext&, Pass&) const;

}  // namespace rilievo

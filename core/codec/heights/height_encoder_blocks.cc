#include "core/codec/heights/height_encoder_blocks.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "core/base/status_macros.h"
#include "core/codec/bytes/range_coder.h"
#include "core/codec/heights/group_heights.h"
#include "core/codec/heights/height_encoder_level.h"
#include "core/codec/heights/height_encoder_unit.h"
#include "core/loop/face_vertices.h"

namespace rilievo {
namespace {

constexpr int kSampledGroups = 16;
// Rounds of quantisation before the coarse levels are coded, and of these alone.
constexpr int kCoarseRounds = 2;

// The vertices of the faces that the block is about.
std::vector<uint8_t> InnerVertices(const GroupBlock& block) {
  const FaceVertices vertices(block.refinement.levels[0], block.part.surface.max_level);
  std::vector<uint8_t> inner(block.part.surface.heights.size(), 0);
  std::vector<int> of_face;
  for (const int f : block.part.inner) {
    vertices.Of(f, of_face);
    for (const int v : of_face) inner[v] = 1;
  }
  return inner;
}

bool IsAmount(double value) { return std::isfinite(value) && value >= 0; }

bool AreAmounts(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), IsAmount);
}

bool IsPossible(const HeightSums& sums) {
  return IsAmount(sums.squared) && IsAmount(sums.weight) && IsAmount(sums.max);
}

// What is found of a block may come of another process: IsOf() tells whether it can be.

// Of the groups sampled, what a plan takes.
struct SampledFigures {
  std::vector<HeightLifting::RuleSums> details;
  std::vector<double> level_gains, mean_gains;
  std::vector<int64_t> counts;

  template <typename Archive, typename Self>
  static void Visit(Archive& archive, Self& self) {
    archive(self.details);
    archive(self.level_gains);
    archive(self.mean_gains);
    archive(self.counts);
  }
  bool IsOf(size_t levels) const {
    return details.size() + 1 == levels && level_gains.size() == levels &&
           mean_gains.size() == levels && counts.size() == levels && AreAmounts(level_gains) &&
           AreAmounts(mean_gains) &&
           std::all_of(counts.begin(), counts.end(), [](int64_t count) { return count >= 0; }) &&
           std::all_of(details.begin(), details.end(), [](const HeightLifting::RuleSums& sums) {
             return std::all_of(sums.begin(), sums.end(), IsAmount);
           });
  }
};

// Of one block, by round.
struct SumsOfBlock {
  std::vector<HeightSums> rounds;

  template <typename Archive, typename Self>
  static void Visit(Archive& archive, Self& self) {
    archive(self.rounds);
  }
  bool IsOf(int count) const {
    return rounds.size() == static_cast<size_t>(count) &&
           std::all_of(rounds.begin(), rounds.end(), IsPossible);
  }
};

// Of the vertices of the shared levels that a block decides of.
struct TargetsOfBlock {
  std::vector<int> there;  // in the whole
  std::vector<double> targets, gains;
  std::vector<uint8_t> filled;
  double highest = 0, largest_target = 0;  // of all levels, magnitudes

  template <typename Archive, typename Self>
  static void Visit(Archive& archive, Self& self) {
    archive(self.there);
    archive(self.targets);
    archive(self.gains);
    archive(self.filled);
    archive(self.highest);
    archive(self.largest_target);
  }
  bool IsOf(int shared_count) const {
    const auto is_there = [&](int v) { return v >= 0 && v < shared_count; };
    const auto is_target = [&](double target) { return std::abs(target) <= largest_target; };
    const auto is_flag = [](uint8_t flag) { return flag <= 1; };
    return targets.size() == there.size() && gains.size() == there.size() &&
           filled.size() == there.size() && std::all_of(there.begin(), there.end(), is_there) &&
           std::all_of(targets.begin(), targets.end(), is_target) && AreAmounts(gains) &&
           std::all_of(filled.begin(), filled.end(), is_flag) && IsAmount(highest) &&
           IsAmount(largest_target);
  }
};

struct CodedBlock {
  bool fits = true;  // see GroupPieces
  HeightSums sums;
  std::vector<std::vector<uint8_t>> pieces;  // group after group, from level to level

  template <typename Archive, typename Self>
  static void Visit(Archive& archive, Self& self) {
    archive(self.fits);
    archive(self.sums);
    archive(self.pieces);
  }
  bool IsOf(size_t count) const { return !fits || (pieces.size() == count && IsPossible(sums)); }
};

HeightPlan PlanOf(const std::vector<SampledFigures>& samples, HeightPlan plan) {
  const size_t levels = samples[0].level_gains.size();
  for (size_t l = 0; l < levels; ++l) {
    double gain = 0, weight = 0, mean = 0;
    for (const SampledFigures& sample : samples) {
      if (!(sample.level_gains[l] > 0)) continue;
      const auto count = static_cast<double>(sample.counts[l]);
      gain += count * sample.level_gains[l];
      mean += count * sample.mean_gains[l] / sample.level_gains[l];
      weight += count;
    }
    plan.level_gains.push_back(weight > 0 ? gain / weight : 0);
    plan.mean_gains.push_back(weight > 0 ? mean / weight * plan.level_gains.back() : 0);
    if (l == 0) continue;
    HeightLifting::RuleSums sums{};
    for (const SampledFigures& sample : samples) {
      for (size_t rule = 0; rule < sums.size(); ++rule) sums[rule] += sample.details[l - 1][rule];
    }
    LiftingStep step;
    step.rule = static_cast<int>(std::min_element(sums.begin(), sums.end()) - sums.begin());
    plan.lifting.push_back(step);
  }
  return plan;
}

}  // namespace

// By vertex of the last shared level, those of the whole.
struct HeightEncoderBlocks::CoarseTargets {
  std::vector<double> targets, gains;
  std::vector<uint8_t> filled;
  double highest = 0, largest_target = 0;  // of all levels, magnitudes
};

struct HeightEncoderBlocks::CoarseLevels {
  SharedHeights shared;  // by vertex and face of the whole
  std::vector<std::vector<uint8_t>> layers;
  bool fits = true;
};

absl::StatusOr<std::unique_ptr<HeightEncoderBlocks>> HeightEncoderBlocks::Make(
    const EncodeBlocks& blocks, int smallest_hole, const RunContext& context) {
  auto made = std::unique_ptr<HeightEncoderBlocks>(new HeightEncoderBlocks(blocks, smallest_hole));
  RILIEVO_RETURN_IF_ERROR(made->MakePlan(context));
  return made;
}

std::unique_ptr<HeightEncoder> HeightEncoderBlocks::EncoderOf(const GroupBlock& block) const {
  auto encoder = std::make_unique<HeightEncoder>(block.part.surface, block.refinement,
                                                 smallest_hole_, &block.groups, &plan_);
  encoder->set_counted(InnerVertices(block));
  return encoder;
}

absl::Status HeightEncoderBlocks::MakePlan(const RunContext& context) {
  const StoredSurface& surface = blocks_.surface();
  plan_.mean_weight =
      MeanHeightWeight(surface.control_mesh, blocks_.shared().levels[0], surface.max_level);
  plan_.has_filled = surface.source_counts[static_cast<size_t>(HeightSource::kFilled)] > 0;
  const auto sample = [&](const GroupBlock& block,
                          const RunContext&) -> absl::StatusOr<SampledFigures> {
    const auto encoder = EncoderOf(block);
    return SampledFigures{encoder->detail_sums(), encoder->gains().of_level, encoder->mean_gains(),
                          encoder->coded_counts()};
  };
  RILIEVO_ASSIGN_OR_RETURN(
      const std::vector<SampledFigures> samples,
      blocks_.Gather<SampledFigures>(blocks_.Samples(kSampledGroups), context, sample));
  for (const SampledFigures& of_group : samples) {
    if (!of_group.IsOf(static_cast<size_t>(surface.max_level) + 1)) {
      return EncodeBlocks::NotOfBlock();
    }
  }
  plan_ = PlanOf(samples, std::move(plan_));
  if (!AreAmounts(plan_.level_gains) || !AreAmounts(plan_.mean_gains)) {
    return EncodeBlocks::NotOfBlock();
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<double>> HeightEncoderBlocks::RmsOfRounds(
    double step, int rounds, const RunContext& context) const {
  const auto sample = [&](const GroupBlock& block,
                          const RunContext& own) -> absl::StatusOr<SumsOfBlock> {
    const auto encoder = EncoderOf(block);
    SumsOfBlock found;
    RILIEVO_ASSIGN_OR_RETURN(found.rounds, encoder->SumsOfRounds(step, rounds, own, nullptr));
    return found;
  };
  RILIEVO_ASSIGN_OR_RETURN(
      const std::vector<SumsOfBlock> samples,
      blocks_.Gather<SumsOfBlock>(blocks_.Samples(kSampledGroups), context, sample));
  for (const SumsOfBlock& of_group : samples) {
    if (!of_group.IsOf(rounds)) return EncodeBlocks::NotOfBlock();
  }
  std::vector<double> rms;
  for (int round = 0; round < rounds; ++round) {
    HeightSums all;
    for (const SumsOfBlock& of_group : samples) all.Add(of_group.rounds[round]);
    rms.push_back(all.rms());
  }
  return rms;
}

absl::StatusOr<HeightEncoderBlocks::CoarseTargets> HeightEncoderBlocks::TargetsOfCoarse(
    double step, const RunContext& context) const {
  CoarseTargets coarse;
  const auto count = static_cast<size_t>(blocks_.shared_count());
  coarse.targets.resize(count);
  coarse.gains.resize(count);
  coarse.filled.resize(count);
  const auto find = [&](const GroupBlock& block,
                        const RunContext& own) -> absl::StatusOr<TargetsOfBlock> {
    const auto encoder = EncoderOf(block);
    std::vector<double> targets;
    RILIEVO_RETURN_IF_ERROR(encoder->SumsOfRounds(step, kCoarseRounds, own, &targets).status());
    TargetsOfBlock found;
    found.largest_target = Farthest(targets);
    found.highest = Farthest(block.part.surface.heights);
    for (size_t v = 0; v < block.coarse_there.size(); ++v) {
      if (!blocks_.Owns(block.range, block.coarse_there[v])) continue;
      found.there.push_back(block.coarse_there[v]);
      found.targets.push_back(targets[v]);
      found.gains.push_back(encoder->gains().of_vertex[v]);
      found.filled.push_back(encoder->filled()[v]);
    }
    return found;
  };
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<TargetsOfBlock> found,
                           blocks_.Gather<TargetsOfBlock>(blocks_.ranges(), context, find));
  for (size_t b = 0; b < found.size(); ++b) {
    const TargetsOfBlock& of_block = found[b];
    if (!of_block.IsOf(blocks_.shared_count())) return EncodeBlocks::NotOfBlock();
    coarse.highest = std::max(coarse.highest, of_block.highest);
    coarse.largest_target = std::max(coarse.largest_target, of_block.largest_target);
    for (size_t i = 0; i < of_block.there.size(); ++i) {
      const int v = of_block.there[i];
      if (!blocks_.Owns(blocks_.ranges()[b], v)) return EncodeBlocks::NotOfBlock();
      coarse.targets[v] = of_block.targets[i];
      coarse.gains[v] = of_block.gains[i];
      coarse.filled[v] = of_block.filled[i];
    }
  }
  return coarse;
}

HeightEncoderBlocks::CoarseLevels HeightEncoderBlocks::CodeCoarse(double step,
                                                                  const CoarseTargets& coarse,
                                                                  double least_unit) const {
  const std::vector<double> steps = StepsOfLevels(step, plan_.level_gains);
  CoarseLevels coded;
  SharedHeights& shared = coded.shared;
  shared.unit = UnitOfHeights(steps, coarse.highest, coarse.largest_target, least_unit);
  std::vector<double> in_units = coarse.targets;
  for (double& target : in_units) target /= shared.unit;
  std::vector<Dequantizer> dequantizers(kFirstGroupedLevel);
  for (int round = 0; round < kCoarseRounds; ++round) {
    shared.state = HeightState();
    shared.state.filled = coarse.filled;
    shared.values.clear();
    shared.models = HeightModels();
    coded.layers.clear();
    for (int l = 0; l < kFirstGroupedLevel && coded.fits; ++l) {
      dequantizers[l].step = StepInUnits(steps[l], shared.unit);
      coded.fits = CodeLevelOfWhole<RangeEncoder>(
          blocks_.shared(), l, l > 0 ? plan_.lifting[l - 1] : LiftingStep{0, 0},
          {in_units, coarse.gains, plan_.mean_gains[l]}, plan_.has_filled, dequantizers[l],
          shared.models, shared.state, shared.values, &coded.layers.emplace_back());
    }
  }
  return coded;
}

SharedHeights HeightEncoderBlocks::SharedOf(const GroupBlock& block,
                                            const CoarseLevels& coarse) const {
  const SharedHeights& whole = coarse.shared;
  SharedHeights shared;
  shared.unit = whole.unit;
  shared.models = whole.models;
  shared.state = StateOfGroup(whole.state, block.part.faces, block.coarse_there);
  for (const int v : block.coarse_there) shared.values.push_back(whole.values[v]);
  return shared;
}

absl::StatusOr<bool> HeightEncoderBlocks::CodeGroups(double step, const CoarseLevels& coarse,
                                                     const RunContext& context,
                                                     EncodedHeights* encoded) const {
  const std::vector<GroupRange>& ranges = blocks_.ranges();
  const int levels = blocks_.surface().max_level + 1 - kFirstGroupedLevel;
  const auto code = [&](const GroupBlock& block,
                        const RunContext& own) -> absl::StatusOr<CodedBlock> {
    const auto encoder = EncoderOf(block);
    RILIEVO_ASSIGN_OR_RETURN(GroupPieces made,
                             encoder->EncodeGroups(SharedOf(block, coarse), step, own));
    CodedBlock coded{made.fits, made.sums, {}};
    for (size_t g = 0; g < made.pieces.size(); ++g) {
      const int there = block.group_there[g];
      if (there < block.range.first || there >= block.range.last) continue;
      for (std::vector<uint8_t>& piece : made.pieces[g]) coded.pieces.push_back(std::move(piece));
    }
    return coded;
  };
  RILIEVO_ASSIGN_OR_RETURN(std::vector<CodedBlock> blocks,
                           blocks_.Gather<CodedBlock>(ranges, context, code));
  std::vector<std::vector<std::vector<uint8_t>>> pieces(levels);
  HeightSums all;
  bool fits = true;
  for (size_t i = 0; i < blocks.size(); ++i) {
    CodedBlock& block = blocks[i];
    const auto groups = static_cast<size_t>(ranges[i].last - ranges[i].first);
    if (!block.IsOf(groups * pieces.size())) return EncodeBlocks::NotOfBlock();
    fits = fits && block.fits;
    if (!block.fits) continue;
    all.Add(block.sums);
    size_t next = 0;
    for (size_t g = 0; g < groups; ++g) {
      for (auto& of_level : pieces) of_level.push_back(std::move(block.pieces[next++]));
    }
  }
  if (!fits) return false;
  const std::vector<double> steps = StepsOfLevels(step, plan_.level_gains);
  encoded->step = step;
  encoded->unit = coarse.shared.unit;
  encoded->rms = all.rms();
  encoded->max = all.max;
  encoded->layers = coarse.layers;
  for (int l = 0; l < levels; ++l) {
    const int level = kFirstGroupedLevel + l;
    encoded->layers.push_back(WriteGroupedLayout(
        plan_.lifting[level - 1], StepInUnits(steps[level], encoded->unit), pieces[l]));
  }
  return true;
}

absl::StatusOr<EncodedHeights> HeightEncoderBlocks::Encode(double step,
                                                           const RunContext& context) const {
  RILIEVO_ASSIGN_OR_RETURN(const CoarseTargets coarse, TargetsOfCoarse(step, context));
  for (double least_unit = 0;;) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    const CoarseLevels levels = CodeCoarse(step, coarse, least_unit);
    EncodedHeights encoded;
    bool fits = levels.fits;
    if (fits) {
      RILIEVO_ASSIGN_OR_RETURN(fits, CodeGroups(step, levels, context, &encoded));
    }
    if (fits) return encoded;
    least_unit = WiderUnit(levels.shared.unit);
  }
}

}  // namespace rilievo

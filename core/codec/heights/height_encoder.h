// Heights to bytes at a quantiser step of one's choice: transform, rate-distortion optimised
// quantisation, entropy coding.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/heights/height_coder.h"
#include "core/codec/heights/height_layout.h"
#include "core/codec/heights/height_lifting.h"
#include "core/codec/heights/height_weights.h"
#include "core/codec/mesh/face_groups.h"
#include "core/loop/face_vertices.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {

struct EncodedHeights {
  double step = 0;                           // as asked for
  double unit = 0;                           // of the decoder's integers, fraction of the diagonal
  std::vector<std::vector<uint8_t>> layers;  // payloads of the H chunks
  double rms = 0;                            // decoded against given heights, by area, filled ones
  double max = 0;                            // left out
  int64_t bytes() const;
};

// What is the same for all parts of a surface that are coded apart (height_encoder_blocks.h).
struct HeightPlan {
  double mean_weight = 0;  // MeanHeightWeight
  bool has_filled = false;
  // Of each level from 1 on; empty: to be chosen, as what follows.
  std::vector<LiftingStep> lifting;
  std::vector<double> level_gains, mean_gains;  // of each level
  bool chosen() const { return !lifting.empty(); }
};

// What the levels below kFirstGroupedLevel leave once they are coded, by vertex and face of a part.
struct SharedHeights {
  double unit = 0;
  HeightState state;
  std::vector<int32_t> values;  // of their coefficients, in units
  HeightModels models;
};

// Squared errors of the heights that count, by weight.
struct HeightSums {
  double squared = 0, weight = 0, max = 0;
  void Add(const HeightSums& other) {
    squared += other.squared;
    weight += other.weight;
    max = std::max(max, other.max);
  }
  double rms() const { return weight > 0 ? std::sqrt(squared / weight) : 0; }
};

struct GroupPieces {
  std::vector<std::vector<std::vector<uint8_t>>> pieces;  // (group)(level - kFirstGroupedLevel)
  HeightSums sums;
  bool fits = true;  // no height beyond the range of the format; else there are no pieces
};

// Heights that can be coded with any step.
class HeightCoding {
 public:
  virtual ~HeightCoding() = default;

  // `step`: of the quantiser at the finest level, fraction of the diagonal. Level l's is larger by
  // the square root of what its coefficients' errors cost less (CoefficientGains), smaller where
  // they cost more, so that the slope of error over bits is the same everywhere.
  virtual absl::StatusOr<EncodedHeights> Encode(double step, const RunContext& context) const = 0;

  // The RMS error after each of the first `rounds`, [1, inf), of those that Encode() goes through.
  virtual absl::StatusOr<std::vector<double>> RmsOfRounds(double step, int rounds,
                                                          const RunContext& context) const = 0;
};

// Holds what does not depend on the step, so that many steps can be tried.
class HeightEncoder : public HeightCoding {
 public:
  // `surface` has been checked: its heights are finite and fit `refinement`, which reaches
  // max(0, max_level - 1) and must outlive this. `smallest_hole`: see EncodeOptions.
  // `groups`: of the control faces, coded apart; they must outlive this too. Null: none.
  // `plan`: of the surface that this is a part of.
  // `keep_zero_border`: see EncodeOptions; not with a plan.
  HeightEncoder(const DisplacedSurface& surface, const LoopRefinement& refinement,
                int smallest_hole, const FaceGroups* groups = nullptr,
                const HeightPlan* plan = nullptr, bool keep_zero_border = false);

  ~HeightEncoder() override;
  HeightEncoder(const HeightEncoder&) = delete;
  HeightEncoder& operator=(const HeightEncoder&) = delete;

  bool has_filled() const { return has_filled_; }
  const std::vector<uint8_t>& filled() const { return filled_; }  // without small holes

  absl::StatusOr<EncodedHeights> Encode(double step, const RunContext& context) const override;
  absl::StatusOr<std::vector<double>> RmsOfRounds(double step, int rounds,
                                                  const RunContext& context) const override;

  // Of a part: only errors of these vertices count. One a vertex.
  void set_counted(std::vector<uint8_t> counted) { counted_ = std::move(counted); }
  // The sums that RmsOfRounds() tells of; `corrected`, unless null, becomes the coefficients that
  // the next round would quantise.
  absl::StatusOr<std::vector<HeightSums>> SumsOfRounds(double step, int rounds,
                                                       const RunContext& context,
                                                       std::vector<double>* corrected) const;
  // The pieces of a part's groups under shared levels that are coded already.
  absl::StatusOr<GroupPieces> EncodeGroups(const SharedHeights& shared, double step,
                                           const RunContext& context) const;

  // What a plan is made of.
  const std::vector<HeightLifting::RuleSums>& detail_sums() const { return detail_sums_; }
  const CoefficientGains& gains() const { return gains_; }
  const std::vector<double>& mean_gains() const { return mean_gains_; }
  const std::vector<int64_t>& coded_counts() const { return coded_counts_; }  // of each level

 private:
  struct Pass;
  bool grouped() const { return groups_ != nullptr && max_level_ >= kFirstGroupedLevel; }
  // `Coder`: RangeEncoder, or NoBytes where the bytes are not asked for.
  template <typename Coder>
  absl::Status CodeGroup(int group, const FaceVertices& vertices_of_whole,
                         const std::vector<double>& targets_in_units, const HeightModels& models,
                         const RunContext& context, Pass& pass) const;
  template <typename Coder>
  absl::Status CodeGroups(const std::vector<double>& targets_in_units, const HeightModels& models,
                          const RunContext& context, Pass& pass) const;
  bool IsTold(size_t v) const { return rings_[v] == 0; }
  bool IsFree(size_t v) const { return rings_[v] > kRimRings; }
  void FreeInnerHeights();
  static std::unique_ptr<HeightModels> TakeShared(Pass& pass);
  template <typename Coder>
  absl::Status RunPass(double step, std::vector<double> targets, const RunContext& context,
                       Pass& pass) const;
  template <typename Coder>
  absl::Status CodeInUnits(const std::vector<double>& steps,
                           const std::vector<double>& targets_in_units, const RunContext& context,
                           Pass& pass) const;
  template <typename Coder>
  void CodeLevel(int level, const std::vector<double>& targets_in_units, HeightModels& models,
                 Pass& pass) const;
  std::vector<double> CorrectedTargets(const Pass& pass) const;
  double ErrorAt(size_t v, const Pass& pass) const;
  void DropFixed(const Pass& pass, std::vector<double>& change) const;
  double ShareOfChange(const Pass& pass, const std::vector<double>& change) const;
  template <typename Coder>
  absl::Status RunRound(int round, double step, const RunContext& context, Pass& pass) const;
  HeightSums SumsOf(const Pass& pass) const;
  EncodedHeights Finish(double step, const Pass& pass) const;

  const LoopRefinement& refinement_;
  const FaceGroups* groups_;
  int max_level_;
  std::vector<float> heights_;
  std::vector<uint8_t> rings_;   // from the nearest told height, up to kRimRings + 1; 0: told
  std::vector<uint8_t> filled_;  // without small holes
  bool has_filled_ = false;
  HeightLifting lifting_;
  std::vector<double> weights_;  // of the heights, sum 1
  CoefficientGains gains_;
  std::vector<double> mean_gains_;                    // of each level's coefficients that are coded
  std::vector<double> targets_;                       // coefficients before quantisation
  std::vector<HeightLifting::RuleSums> detail_sums_;  // unless planned, as the counts
  std::vector<int64_t> coded_counts_;
  std::vector<uint8_t> counted_;  // empty: all
  std::vector<int> zeros_;        // whose coefficients stay zero
};

}  // namespace rilievo

// Heights to bytes at a quantiser step of one's choice: transform, rate-distortion optimised
// quantisation, entropy coding.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/heights/height_coder.h"
#include "core/codec/heights/height_layout.h"
#include "core/codec/heights/height_lifting.h"
#include "core/codec/heights/height_weights.h"
#include "core/codec/mesh/face_groups.h"
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

// Holds what does not depend on the step, so that many steps can be tried.
class HeightEncoder {
 public:
  // `surface` has been checked: its heights are finite and fit `refinement`, which reaches
  // max(0, max_level - 1) and must outlive this. `smallest_hole`: see EncodeOptions.
  HeightEncoder(const DisplacedSurface& surface, const LoopRefinement& refinement,
                int smallest_hole);

  // The same for `groups` of the control faces that are coded apart; they must outlive it.
  // CANCELLED is the only error.
  static absl::StatusOr<std::unique_ptr<HeightEncoder>> MakeGrouped(
      const DisplacedSurface& surface, const LoopRefinement& refinement, int smallest_hole,
      const FaceGroups& groups, const RunContext& context);

  ~HeightEncoder();
  HeightEncoder(const HeightEncoder&) = delete;
  HeightEncoder& operator=(const HeightEncoder&) = delete;

  bool has_filled() const { return has_filled_; }
  const std::vector<uint8_t>& filled() const { return filled_; }  // without small holes

  // `step`: of the quantiser at the finest level, fraction of the diagonal. Level l's is larger by
  // the square root of what its coefficients' errors cost less (CoefficientGains), smaller where
  // they cost more, so that the slope of error over bits is the same everywhere.
  absl::StatusOr<EncodedHeights> Encode(double step, const RunContext& context) const;

  // The RMS error after each of the first `rounds`, [1, inf), of those that Encode() goes through.
  absl::StatusOr<std::vector<double>> RmsOfRounds(double step, int rounds,
                                                  const RunContext& context) const;

 private:
  struct Pass;
  struct Group;
  bool grouped() const { return groups_ != nullptr && max_level_ >= kFirstGroupedLevel; }
  absl::Status BuildGroups(const FaceGroups& groups, const RunContext& context);
  // `Coder`: RangeEncoder, or NoBytes where the bytes are not asked for.
  template <typename Coder>
  void CodeGroup(const Group& group, const std::vector<double>& targets_in_units,
                 const HeightModels& models, Pass& pass) const;
  template <typename Coder>
  absl::Status CodeGroups(const std::vector<double>& targets_in_units, const HeightModels& models,
                          const RunContext& context, Pass& pass) const;
  bool IsTold(size_t v) const { return rings_[v] == 0; }
  bool IsFree(size_t v) const { return rings_[v] > kRimRings; }
  void FreeInnerHeights();
  std::vector<double> StepsOfLevels(double step) const;
  template <typename Coder>
  absl::Status RunPass(double step, const std::vector<double>& targets, const RunContext& context,
                       Pass& pass) const;
  template <typename Coder>
  absl::Status CodeInUnits(const std::vector<double>& steps, const std::vector<double>& targets,
                           const RunContext& context, Pass& pass) const;
  template <typename Coder>
  void CodeLevel(int level, const std::vector<double>& targets_in_units, HeightModels& models,
                 Pass& pass) const;
  std::vector<double> CorrectedTargets(const Pass& pass) const;
  template <typename Coder>
  absl::Status RunRound(int round, double step, const RunContext& context, Pass& pass) const;
  EncodedHeights Finish(double step, const Pass& pass) const;

  const LoopRefinement& refinement_;
  const FaceGroups* groups_ = nullptr;
  std::vector<Group> group_meshes_;
  int max_level_;
  std::vector<double> heights_;
  std::vector<uint8_t> rings_;   // from the nearest told height, up to kRimRings + 1; 0: told
  std::vector<uint8_t> filled_;  // without small holes
  bool has_filled_ = false;
  HeightLifting lifting_;
  std::vector<double> weights_;  // of the heights, sum 1
  CoefficientGains gains_;
  std::vector<double> mean_gains_;  // of each level's coefficients that are coded
  std::vector<double> targets_;     // coefficients before quantisation
};

}  // namespace rilievo

// Heights to bytes in memory that does not grow with them: in blocks of groups.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/codec/heights/encode_blocks.h"
#include "core/codec/heights/height_encoder.h"

namespace rilievo {

// What HeightEncoder does with the whole of a surface with groups, done with each block and the
// faces that its coefficients depend on: transform, quantisation in rounds, entropy coding. What
// the blocks have in common (rules, gains, step) comes of some groups, the two coarsest levels of
// the coefficients that all blocks come to. The bytes do not depend on the number of threads.
class HeightEncoderBlocks : public HeightCoding {
 public:
  // `blocks` is kept by reference; its surface has kFirstGroupedLevel levels at least. The errors
  // of its heights' Read() and CANCELLED.
  static absl::StatusOr<std::unique_ptr<HeightEncoderBlocks>> Make(const EncodeBlocks& blocks,
                                                                   int smallest_hole,
                                                                   const RunContext& context);

  bool has_filled() const { return plan_.has_filled; }

  absl::StatusOr<EncodedHeights> Encode(double step, const RunContext& context) const override;
  // Of some groups.
  absl::StatusOr<std::vector<double>> RmsOfRounds(double step, int rounds,
                                                  const RunContext& context) const override;

 private:
  struct CoarseTargets;
  struct CoarseLevels;
  HeightEncoderBlocks(const EncodeBlocks& blocks, int smallest_hole)
      : blocks_(blocks), smallest_hole_(smallest_hole) {}
  std::unique_ptr<HeightEncoder> EncoderOf(const GroupBlock& block) const;
  absl::Status MakePlan(const RunContext& context);
  absl::StatusOr<CoarseTargets> TargetsOfCoarse(double step, const RunContext& context) const;
  CoarseLevels CodeCoarse(double step, const CoarseTargets& coarse, double least_unit) const;
  SharedHeights SharedOf(const GroupBlock& block, const CoarseLevels& coarse) const;
  absl::StatusOr<bool> CodeGroups(double step, const CoarseLevels& coarse,
                                  const RunContext& context, EncodedHeights* encoded) const;

  const EncodeBlocks& blocks_;
  int smallest_hole_;
  HeightPlan plan_;
};

}  // namespace rilievo

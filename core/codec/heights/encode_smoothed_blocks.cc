#include "core/codec/heights/encode_smoothed_blocks.h"

#include <algorithm>
#include <utility>
#include <vector>

#include "core/base/status_macros.h"
#include "core/codec/bytes/pieces.h"
#include "core/codec/bytes/range_coder.h"
#include "core/codec/heights/holes.h"
#include "core/codec/heights/smoothed_flags.h"
#include "core/loop/face_vertices.h"

namespace rilievo {
namespace {

// By vertex.
struct BlockFlags {
  std::vector<uint8_t> filled, smoothed;
};

BlockFlags FlagsOfBlock(const GroupBlock& block, int smallest, int patch) {
  const DisplacedSurface& surface = block.part.surface;
  BlockFlags flags;
  for (const HeightSource source : surface.sources) {
    flags.filled.push_back(source == HeightSource::kFilled);
  }
  DropSmallHoles(block.refinement, surface.max_level, smallest, flags.filled);
  flags.smoothed = NotMeasured(surface.sources, flags.filled);
  DropSmallPatches(block.refinement, surface.max_level, patch, flags.filled, flags.smoothed);
  return flags;
}

class SmoothedBlocks {
 public:
  SmoothedBlocks(const EncodeBlocks& blocks, int smallest, int patch)
      : blocks_(blocks), smallest_(smallest), patch_(patch) {}

  absl::StatusOr<FlagsOfPatches> Run(const RunContext& context) {
    RILIEVO_RETURN_IF_ERROR(FindShared(context));
    if (!found_.any || found_.all) return found_;
    HeightState state;
    state.filled = shared_.smoothed;
    RangeEncoder coder;
    CodeSmoothedLevels(coder, blocks_.shared(), 0, kFirstGroupedLevel, shared_.filled, models_,
                       state);
    pieces_.resize(1 + blocks_.groups().count());
    pieces_[0] = coder.Finish();
    RILIEVO_RETURN_IF_ERROR(CodeGroups(context));
    AppendPieces(pieces_, &found_.payload);
    return found_;
  }

 private:
  // The flags of the shared levels, and whether there are both kinds.
  absl::Status FindShared(const RunContext& context) {
    const auto count = static_cast<size_t>(blocks_.shared_count());
    shared_ = {std::vector<uint8_t>(count), std::vector<uint8_t>(count)};
    std::vector<uint8_t> smoothed(blocks_.ranges().size()), measured(smoothed.size());
    const auto take = [&](size_t i, const GroupBlock& block, const RunContext& /*context*/) {
      const BlockFlags flags = FlagsOfBlock(block, smallest_, patch_);
      const FaceVertices vertices(block.refinement.levels[0], block.part.surface.max_level);
      std::vector<int> of_face;
      for (const int f : block.part.inner) {
        vertices.Of(f, of_face);
        for (const int v : of_face) {
          if (flags.filled[v] == 0) (flags.smoothed[v] != 0 ? smoothed : measured)[i] = 1;
        }
      }
      for (size_t v = 0; v < block.coarse_there.size(); ++v) {
        const int there = block.coarse_there[v];
        if (!blocks_.Owns(block.range, there)) continue;
        shared_.filled[there] = flags.filled[v];
        shared_.smoothed[there] = flags.smoothed[v];
      }
      return absl::OkStatus();
    };
    RILIEVO_RETURN_IF_ERROR(blocks_.ForEach(blocks_.ranges(), context, take));
    found_.any = std::find(smoothed.begin(), smoothed.end(), 1) != smoothed.end();
    found_.all = found_.any && std::find(measured.begin(), measured.end(), 1) == measured.end();
    return absl::OkStatus();
  }

  absl::Status CodeGroups(const RunContext& context) {
    const auto code = [&](size_t /*i*/, const GroupBlock& block,
                          const RunContext& one_thread) -> absl::Status {
      BlockFlags flags = FlagsOfBlock(block, smallest_, patch_);
      for (size_t v = 0; v < block.coarse_there.size(); ++v) {
        flags.filled[v] = shared_.filled[block.coarse_there[v]];
        flags.smoothed[v] = shared_.smoothed[block.coarse_there[v]];
      }
      const int level = block.part.surface.max_level;
      const MeshTopology& control = block.refinement.levels[0];
      const FaceVertices numbers(control, level);
      for (int g = 0; g < block.groups.count(); ++g) {
        const int there = block.group_there[g];
        if (there < block.range.first || there >= block.range.last) continue;
        RILIEVO_ASSIGN_OR_RETURN(const GroupMesh mesh,
                                 BuildGroupMesh(control, block.groups, g, level, one_thread));
        pieces_[1 + there] = EncodeSmoothedOfGroup(mesh, numbers, block.groups.members[g], level,
                                                   flags.filled, flags.smoothed, models_);
      }
      return absl::OkStatus();
    };
    return blocks_.ForEach(blocks_.ranges(), context, code);
  }

  const EncodeBlocks& blocks_;
  int smallest_, patch_;
  BlockFlags shared_;  // by vertex of the last shared level of the whole
  HeightModels models_;
  FlagsOfPatches found_;
  std::vector<std::vector<uint8_t>> pieces_;  // of the shared levels, then of each group
};

}  // namespace

absl::StatusOr<EncodedFlags> EncodeSmoothedBlocks(const EncodeBlocks& blocks, int smallest,
                                                  int64_t bytes, int64_t most,
                                                  const RunContext& context) {
  const auto count = [&](HeightSource source) {
    return blocks.surface().source_counts[static_cast<size_t>(source)];
  };
  const SourceCounts counts = {count(HeightSource::kSmoothed), count(HeightSource::kMeasured),
                               count(HeightSource::kSmoothed) + count(HeightSource::kMeasured)};
  return ChooseSmoothedFlags(counts, smallest, bytes, most, [&](int patch) {
    return SmoothedBlocks(blocks, smallest, patch).Run(context);
  });
}

}  // namespace rilievo

#include "core/codec/heights/smoothed_flags.h"

#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/pieces.h"
#include "core/codec/bytes/range_coder.h"

namespace rilievo {
namespace {

constexpr absl::string_view kFlags = "the flags of smoothed heights";

absl::Status CutOff() { return absl::DataLossError(absl::StrCat(kFlags, " are cut off")); }

}  // namespace

std::vector<uint8_t> FlagsOfGroup(const std::vector<uint8_t>& whole,
                                  const std::vector<int>& vertices) {
  std::vector<uint8_t> own;
  own.reserve(vertices.size());
  for (int v : vertices) own.push_back(whole[v]);
  return own;
}

std::vector<uint8_t> NotOfGroup(const GroupMesh& mesh, const std::vector<uint8_t>& filled) {
  std::vector<uint8_t> elsewhere = mesh.foreign;
  for (size_t v = 0; v < filled.size(); ++v) elsewhere[v] |= filled[v];
  return elsewhere;
}

absl::StatusOr<SmoothedReader> SmoothedReader::Open(std::span<const uint8_t> payload,
                                                    int group_count) {
  SmoothedReader opened;
  if (group_count == 0) {
    opened.shared_ = payload;
    return opened;
  }
  RILIEVO_ASSIGN_OR_RETURN(opened.pieces_, ReadPieces(payload, 0, group_count + 1, kFlags));
  if (!opened.pieces_[0].empty()) {
    RILIEVO_ASSIGN_OR_RETURN(opened.shared_,
                             CheckPiece(opened.pieces_[0], "what smoothed heights share"));
  }
  opened.pieces_.erase(opened.pieces_.begin());
  return opened;
}

absl::Status SmoothedReader::ReadShared(const LoopRefinement& refinement, int level_count,
                                        const std::vector<uint8_t>& filled) {
  RangeDecoder coder(shared_);
  CodeSmoothedLevels(coder, refinement, 0, level_count, filled, models_, state_);
  return coder.overrun() ? CutOff() : absl::OkStatus();
}

absl::StatusOr<std::vector<uint8_t>> SmoothedReader::ReadGroup(
    const GroupMesh& mesh, int max_level, const std::vector<int>& whole_vertex,
    const std::vector<uint8_t>& filled) const {
  HeightState state;
  state.filled = FlagsOfGroup(state_.filled, whole_vertex);
  const std::span<const uint8_t> piece = pieces_[mesh.group];
  if (piece.empty()) {
    state.filled.resize(mesh.refinement.vertex_count(max_level), 0);
    return std::move(state.filled);
  }
  RILIEVO_ASSIGN_OR_RETURN(
      const std::span<const uint8_t> bytes,
      CheckPiece(piece, absl::StrCat("the smoothed heights of group ", mesh.group)));
  RangeDecoder coder(bytes);
  const auto models = std::make_unique<HeightModels>(models_);
  CodeSmoothedLevels(coder, mesh.refinement, kFirstGroupedLevel, max_level + 1,
                     NotOfGroup(mesh, filled), *models, state);
  if (coder.overrun()) return CutOff();
  return std::move(state.filled);
}

}  // namespace rilievo

#include "core/codec/smoothed_flags.h"

#include <memory>
#include <utility>

#include "absl/status/status.h"
#include "core/base/status_macros.h"
#include "core/codec/byte_stream.h"
#include "core/codec/crc32c.h"
#include "core/codec/range_coder.h"

namespace rilievo {
namespace {

absl::Status CutOff() { return absl::DataLossError("the flags of smoothed heights are cut off"); }

// A piece and its checksum, which is looked at.
absl::StatusOr<std::span<const uint8_t>> CheckedPiece(std::span<const uint8_t> piece) {
  if (piece.size() < 4) return CutOff();
  const std::span<const uint8_t> bytes = piece.first(piece.size() - 4);
  if (ByteReader(piece.last(4)).U32() == Crc32c(bytes)) return bytes;
  return absl::DataLossError("a checksum of the flags of smoothed heights is wrong");
}

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
  ByteReader reader(payload);
  // Each takes a byte at least: no more are looked for than can be there.
  if (payload.size() <= static_cast<size_t>(group_count)) return CutOff();
  std::vector<uint64_t> sizes(static_cast<size_t>(group_count) + 1);
  for (uint64_t& size : sizes) size = reader.Varint();
  const size_t index_end = reader.position();
  const uint32_t checksum = reader.U32();
  if (!reader.ok()) return CutOff();
  if (checksum != Crc32c(payload.first(index_end))) {
    return absl::DataLossError("the checksum of the index of smoothed heights is wrong");
  }
  for (uint64_t size : sizes) {
    opened.pieces_.push_back(size == 0 ? std::span<const uint8_t>() : reader.Bytes(size + 4));
  }
  if (!reader.ok()) return CutOff();
  if (!opened.pieces_[0].empty()) {
    RILIEVO_ASSIGN_OR_RETURN(opened.shared_, CheckedPiece(opened.pieces_[0]));
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
  RILIEVO_ASSIGN_OR_RETURN(const std::span<const uint8_t> bytes, CheckedPiece(piece));
  RangeDecoder coder(bytes);
  const auto models = std::make_unique<HeightModels>(models_);
  CodeSmoothedLevels(coder, mesh.refinement, kFirstGroupedLevel, max_level + 1,
                     NotOfGroup(mesh, filled), *models, state);
  if (coder.overrun()) return CutOff();
  return std::move(state.filled);
}

}  // namespace rilievo

// Payloads in pieces that decode by themselves: an index with its checksum, then each piece with
// its own (docs/dss-format.md, Groups).
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "absl/strings/string_view.h"

namespace rilievo {

// Appends index and pieces. The checksum of the index covers all of the payload before it.
void AppendPieces(const std::vector<std::vector<uint8_t>>& pieces, std::vector<uint8_t>* payload);

// The pieces whose index begins at `start`, each with its checksum, which is not looked at; empty
// ones have none. DATA_LOSS, naming `what`, when the index or a piece is cut off or the checksum of
// the index is wrong.
absl::StatusOr<std::vector<std::span<const uint8_t>>> ReadPieces(std::span<const uint8_t> payload,
                                                                 size_t start, int count,
                                                                 absl::string_view what);

// A piece that is not empty, without its checksum. DATA_LOSS, naming `what`, when it is cut off or
// the checksum is wrong.
absl::StatusOr<std::span<const uint8_t>> CheckPiece(std::span<const uint8_t> piece,
                                                    absl::string_view what);

}  // namespace rilievo

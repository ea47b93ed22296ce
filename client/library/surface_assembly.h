// The pieces of a .dss, put together and checked.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "rilievo/v1/reconstruction.pb.h"

namespace rilievo {

// DATA_LOSS when the header tells a SHA-256 and these bytes have another.
absl::Status CheckDigest(const v1::SurfaceHeader& header, const std::vector<uint8_t>& bytes);

// Takes the answers of one call in order. Memory grows by what arrived, whatever was announced.
class SurfaceAssembly {
 public:
  // `known`: the beginning of the file, which no piece brings.
  explicit SurfaceAssembly(std::vector<uint8_t> known = {}) : bytes_(std::move(known)) {}

  absl::Status Begin(const v1::SurfaceHeader& header);

  // DATA_LOSS unless the piece begins where the last one ended and lies in its chunk.
  absl::Status Append(const v1::SurfacePiece& piece);

  // The whole file; DATA_LOSS when bytes are missing, or as CheckDigest().
  absl::StatusOr<std::vector<uint8_t>> Finish() &&;

  std::vector<int64_t> chunk_bytes() const;

 private:
  std::optional<v1::SurfaceHeader> header_;
  std::vector<uint64_t> chunk_end_;  // offset behind each chunk
  std::vector<uint8_t> bytes_;
};

}  // namespace rilievo

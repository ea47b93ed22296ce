// A finished surface on its way out, one message at a time.
#pragma once

#include <cstdint>

#include "core/codec/container/dss.h"
#include "rilievo/v1/reconstruction.pb.h"

namespace rilievo {

// Bytes of .dss in one message. Within the 64 to 256 KiB where gRPC's cost a message is small and a
// slow reader holds little.
inline constexpr size_t kPieceBytes = 128 << 10;

// Makes each message when it is asked for, so that a slow reader costs one message and the encoded
// bytes, nothing more.
class SurfaceDownload {
 public:
  // `known_bytes`: at the beginning of the file, which the client has.
  SurfaceDownload(EncodedSurface encoded, v1::ReconstructReport report, int64_t known_bytes = 0);

  // The next message: header, pieces coarse first, summary. False when all were handed out.
  bool Next(v1::ReconstructResponse* response);

  int64_t total_bytes() const { return total_bytes_; }

 private:
  enum class Part { kHeader, kPieces, kSummary, kEnd };

  void WriteHeader(v1::SurfaceHeader* header) const;
  // False when no piece is left.
  bool WritePiece(v1::SurfacePiece* piece);

  EncodedSurface encoded_;
  v1::ReconstructReport report_;
  int64_t total_bytes_ = 0;
  Part part_ = Part::kHeader;
  size_t chunk_ = 0;
  size_t chunk_offset_ = 0;  // within that chunk
  uint64_t file_offset_;     // within the file
};

}  // namespace rilievo

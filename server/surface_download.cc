#include "server/surface_download.h"

#include <algorithm>
#include <array>
#include <utility>

#include "core/base/sha256.h"

namespace rilievo {

SurfaceDownload::SurfaceDownload(EncodedSurface encoded, v1::ReconstructReport report,
                                 int64_t known_bytes)
    : encoded_(std::move(encoded)),
      report_(std::move(report)),
      file_offset_(static_cast<uint64_t>(known_bytes)) {
  for (const auto& chunk : encoded_.chunks) total_bytes_ += static_cast<int64_t>(chunk.size());
  chunk_offset_ = static_cast<size_t>(known_bytes);
  while (chunk_ < encoded_.chunks.size() && chunk_offset_ >= encoded_.chunks[chunk_].size()) {
    chunk_offset_ -= encoded_.chunks[chunk_++].size();
  }
}

bool SurfaceDownload::Next(v1::ReconstructResponse* response) {
  response->Clear();
  switch (part_) {
    case Part::kHeader:
      WriteHeader(response->mutable_surface());
      part_ = Part::kPieces;
      return true;
    case Part::kPieces:
      if (WritePiece(response->mutable_piece())) return true;
      part_ = Part::kSummary;
      [[fallthrough]];
    case Part::kSummary:
      *response->mutable_summary()->mutable_report() = std::move(report_);
      part_ = Part::kEnd;
      return true;
    case Part::kEnd:
      return false;
  }
  return false;
}

void SurfaceDownload::WriteHeader(v1::SurfaceHeader* header) const {
  header->set_total_bytes(static_cast<uint64_t>(total_bytes_));
  Sha256 hash;
  for (const auto& chunk : encoded_.chunks) {
    header->add_chunk_bytes(chunk.size());
    hash.Add(chunk);
  }
  const std::array<uint8_t, 32> digest = hash.Finish();
  header->set_sha256(digest.data(), digest.size());
}

bool SurfaceDownload::WritePiece(v1::SurfacePiece* piece) {
  while (chunk_ < encoded_.chunks.size() && chunk_offset_ == encoded_.chunks[chunk_].size()) {
    ++chunk_;
    chunk_offset_ = 0;
  }
  if (chunk_ == encoded_.chunks.size()) return false;
  const auto& bytes = encoded_.chunks[chunk_];
  const size_t size = std::min(kPieceBytes, bytes.size() - chunk_offset_);
  piece->set_chunk(static_cast<uint32_t>(chunk_));
  piece->set_offset(file_offset_);
  piece->set_data(bytes.data() + chunk_offset_, size);
  chunk_offset_ += size;
  file_offset_ += size;
  return true;
}

}  // namespace rilievo

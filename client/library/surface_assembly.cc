#include "client/library/surface_assembly.h"

#include <algorithm>
#include <array>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/sha256.h"

namespace rilievo {

absl::Status CheckDigest(const v1::SurfaceHeader& header, const std::vector<uint8_t>& bytes) {
  if (header.sha256().empty()) return absl::OkStatus();
  Sha256 hash;
  hash.Add(bytes);
  const std::array<uint8_t, 32> digest = hash.Finish();
  if (std::equal(digest.begin(), digest.end(), header.sha256().begin(), header.sha256().end(),
                 [](uint8_t a, char b) { return a == static_cast<uint8_t>(b); })) {
    return absl::OkStatus();
  }
  return absl::DataLossError(
      "the surface that arrived is not the one that was made: its SHA-256 differs; fetch it again");
}

absl::Status SurfaceAssembly::Begin(const v1::SurfaceHeader& header) {
  if (header_) return absl::DataLossError("the answer holds two surface headers");
  uint64_t end = 0;
  for (const uint64_t bytes : header.chunk_bytes()) {
    if (bytes > header.total_bytes() - end) break;
    chunk_end_.push_back(end += bytes);
  }
  if (chunk_end_.size() != static_cast<size_t>(header.chunk_bytes_size()) ||
      end != header.total_bytes()) {
    return absl::DataLossError("the announced chunks do not add up to the announced surface");
  }
  header_ = header;
  return absl::OkStatus();
}

absl::Status SurfaceAssembly::Append(const v1::SurfacePiece& piece) {
  if (!header_) return absl::DataLossError("a piece of the surface came before its header");
  if (piece.offset() != bytes_.size() || piece.chunk() >= chunk_end_.size() ||
      piece.offset() > chunk_end_[piece.chunk()] ||
      piece.data().size() > chunk_end_[piece.chunk()] - piece.offset()) {
    return absl::DataLossError(absl::StrCat("a piece at byte ", piece.offset(), " of chunk ",
                                            piece.chunk(), " came where byte ", bytes_.size(),
                                            " was due"));
  }
  bytes_.insert(bytes_.end(), piece.data().begin(), piece.data().end());
  return absl::OkStatus();
}

absl::StatusOr<std::vector<uint8_t>> SurfaceAssembly::Finish() && {
  if (!header_ || bytes_.size() != header_->total_bytes()) {
    return absl::DataLossError(absl::StrCat("the answer ended after ", bytes_.size(), " of ",
                                            header_ ? header_->total_bytes() : 0,
                                            " bytes of the surface"));
  }
  if (const absl::Status digest = CheckDigest(*header_, bytes_); !digest.ok()) return digest;
  return std::move(bytes_);
}

std::vector<int64_t> SurfaceAssembly::chunk_bytes() const {
  if (!header_) return {};
  return {header_->chunk_bytes().begin(), header_->chunk_bytes().end()};
}

}  // namespace rilievo

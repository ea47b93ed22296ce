#include "server/jobs/stored_surface.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/conversion/call_error.h"
#include "server/store/content_name.h"

namespace rilievo {
namespace {

constexpr uint64_t kPieceBytes = 128 << 10;

}  // namespace

absl::StatusOr<uint64_t> FirstByte(const v1::StreamSurfaceRequest& request,
                                   const v1::SurfaceHeader& header) {
  if (!request.has_chunk()) return request.offset();
  if (request.chunk() >= static_cast<uint32_t>(header.chunk_bytes_size())) {
    return StatusOf(
        CallError(ErrorCause::kOffsetOutOfRange,
                  absl::StrCat("chunk: ", request.chunk(), " of a surface with ",
                               header.chunk_bytes_size(), " chunks; begin at one of these"))
            .Limit(header.chunk_bytes_size(), request.chunk()));
  }
  uint64_t begin = 0;
  for (uint32_t i = 0; i < request.chunk(); ++i) begin += header.chunk_bytes(static_cast<int>(i));
  return begin;
}

absl::Status DamagedSurface() {
  return StatusOf({ErrorCause::kSurfaceDamaged,
                   "the surface of this job is damaged or lost; create the job again, with another "
                   "request_id"});
}

absl::StatusOr<StoredSurface> StoredSurface::From(FileDescriptor file, std::string name,
                                                  v1::SurfaceHeader header, uint64_t offset) {
  if (offset > header.total_bytes()) {
    return StatusOf(CallError(ErrorCause::kOffsetOutOfRange,
                              absl::StrCat("offset: ", offset, " of a surface with ",
                                           header.total_bytes(), " bytes; begin within these"))
                        .Limit(header.total_bytes(), offset));
  }
  RILIEVO_ASSIGN_OR_RETURN(const int64_t size, file.Size());
  if (static_cast<uint64_t>(size) != header.total_bytes()) return DamagedSurface();
  return StoredSurface(std::move(file), std::move(name), std::move(header), offset);
}

absl::StatusOr<bool> StoredSurface::Next(v1::StreamSurfaceResponse* response) {
  response->Clear();
  if (!header_sent_) {
    *response->mutable_surface() = header_;
    header_sent_ = true;
    return true;
  }
  if (offset_ >= header_.total_bytes()) {
    if (hash_ && ContentName(*hash_) != name_) return DamagedSurface();
    return false;
  }
  while (offset_ >= chunk_begin_ + header_.chunk_bytes(chunk_)) {
    chunk_begin_ += header_.chunk_bytes(chunk_++);
  }
  const uint64_t size = std::min(kPieceBytes, chunk_begin_ + header_.chunk_bytes(chunk_) - offset_);
  v1::SurfacePiece& piece = *response->mutable_piece();
  piece.set_chunk(static_cast<uint32_t>(chunk_));
  piece.set_offset(offset_);
  piece.mutable_data()->resize(size);
  RILIEVO_RETURN_IF_ERROR(
      file_.ReadAt(static_cast<int64_t>(offset_), piece.mutable_data()->data(), size));
  if (hash_) AddBytes(piece.data().data(), size, &*hash_);
  offset_ += size;
  return true;
}

}  // namespace rilievo

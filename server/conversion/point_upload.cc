#include "server/conversion/point_upload.h"

#include <utility>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

// Chunks smaller than this are gathered, so that many tiny ones cost no more than their bytes.
constexpr size_t kSmallChunkBytes = 64 << 10;

CallError ChunkError(const std::string& description,
                     ErrorCause reason = ErrorCause::kInvalidField) {
  return BadRequestError({{"points.data", description}}, reason);
}

}  // namespace

PointUpload::PointUpload(int64_t point_count, const PointLayout& layout)
    : point_count_(point_count), layout_(layout) {}

std::optional<CallError> PointUpload::Append(std::string&& data) {
  const auto size = static_cast<int64_t>(data.size());
  const int64_t point_bytes = layout_.bytes();
  if (size == 0) return ChunkError("the chunk is empty; send at least one point");
  if (size > kMaxChunkBytes) {
    return ChunkError(absl::StrCat("the chunk has ", size, " bytes; send at most ", kMaxChunkBytes),
                      ErrorCause::kLimitExceeded)
        .Limit(kMaxChunkBytes, size);
  }
  if (size % point_bytes != 0) {
    return ChunkError(
        absl::StrCat("the chunk has ", size, " bytes; whole points take ", point_bytes, " each"));
  }
  if (size > point_count_ * point_bytes - bytes_) {
    return ChunkError(absl::StrCat("more points came than header.point_count announced (",
                                   point_count_, "); announce as many as are sent"));
  }
  bytes_ += size;
  if (data.size() < kSmallChunkBytes && !blocks_.empty() &&
      blocks_.back().size() + data.size() <= static_cast<size_t>(kMaxChunkBytes)) {
    blocks_.back().append(data);
  } else {
    blocks_.push_back(std::move(data));
  }
  return std::nullopt;
}

std::optional<CallError> PointUpload::CheckComplete() const {
  const int64_t points = bytes_ / layout_.bytes();
  if (points == point_count_) return std::nullopt;
  return CallError(ErrorCause::kScanIncomplete,
                   absl::StrCat("the stream was closed after ", points, " of ", point_count_,
                                " announced points; send all of them"))
      .Limit(point_count_, points);
}

ScanBytes PointUpload::TakePoints() {
  bytes_ = 0;
  return ScanBytes(std::exchange(blocks_, {}));
}

}  // namespace rilievo

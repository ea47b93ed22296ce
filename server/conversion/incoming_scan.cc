#include "server/conversion/incoming_scan.h"

#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"
#include "server/conversion/server_options.h"
#include "server/os/unnamed_file.h"

namespace rilievo {
namespace {

// Chunks smaller than this are gathered, so that many tiny ones cost no more than their bytes.
constexpr size_t kSmallChunkBytes = 64 << 10;

CallError TurnError(const char* field, const std::string& description) {
  return BadRequestError({{field, description}}, ErrorCause::kMessageOrder);
}

}  // namespace

std::optional<CallError> IncomingScan::Records::CheckChunk(int64_t size) const {
  const auto error = [&](const std::string& description,
                         ErrorCause reason = ErrorCause::kInvalidField) {
    return BadRequestError({{absl::StrCat(name, ".data"), description}}, reason);
  };
  if (size == 0) return error(absl::StrCat("the chunk is empty; send at least one ", one));
  if (size > kMaxChunkBytes) {
    return error(absl::StrCat("the chunk has ", size, " bytes; send at most ", kMaxChunkBytes),
                 ErrorCause::kLimitExceeded)
        .Limit(kMaxChunkBytes, size);
  }
  if (size % record_bytes != 0) {
    return error(absl::StrCat("the chunk has ", size, " bytes; whole ", name, " take ",
                              record_bytes, " each"));
  }
  if (size > announced * record_bytes - bytes) {
    return error(absl::StrCat("more ", name, " came than ", count_field, " announced (", announced,
                              "); announce as many as are sent"));
  }
  return std::nullopt;
}

std::optional<CallError> IncomingScan::Records::CheckComplete() const {
  if (count() == announced) return std::nullopt;
  return CallError(ErrorCause::kScanIncomplete,
                   absl::StrCat("the stream was closed after ", count(), " of ", announced,
                                " announced ", name, "; send all of them"))
      .Limit(announced, count());
}

IncomingScan::IncomingScan(const PayloadSize& size)
    : points_{"points", "point", "header.point_count", size.layout.bytes(), size.points},
      triangles_{"triangles", "triangle", "header.triangle_count", kTriangleBytes, size.triangles},
      base_{"base", "byte", "header.base_surface.bytes", 1, size.base_bytes} {}

IncomingScan::IncomingScan(const PayloadSize& size, std::string folder) : IncomingScan(size) {
  folder_ = std::move(folder);
}

std::optional<CallError> IncomingScan::AppendPoints(std::string&& data) {
  if (triangles_.bytes + base_.bytes > 0) {
    return TurnError("points", absl::StrCat("they came after ",
                                            triangles_.bytes > 0 ? "triangles" : "the base surface",
                                            "; send all points first"));
  }
  return Append(std::move(data), &points_);
}

std::optional<CallError> IncomingScan::AppendTriangles(std::string&& data) {
  return AppendBehind(std::move(data), &triangles_);
}

std::optional<CallError> IncomingScan::AppendBase(std::string&& data) {
  return AppendBehind(std::move(data), &base_);
}

std::optional<CallError> IncomingScan::AppendBehind(std::string&& data, Records* records) {
  if (records->announced == 0) {
    return TurnError(
        records->name,
        absl::StrCat(records->count_field, " announced none; announce them, or send points alone"));
  }
  if (points_.count() < points_.announced) {
    return TurnError(records->name,
                     absl::StrCat("they came after ", points_.count(), " of ", points_.announced,
                                  " announced points; send all points first"));
  }
  return Append(std::move(data), records);
}

std::optional<CallError> IncomingScan::Append(std::string&& data, Records* records) {
  const auto size = static_cast<int64_t>(data.size());
  if (auto error = records->CheckChunk(size)) return error;
  records->bytes += size;
  if (!folder_.empty()) {
    written_ = AppendToFile(data);
    if (written_.ok()) return std::nullopt;
    if (!absl::IsResourceExhausted(written_)) return ErrorOfJob(absl::UnavailableError(""), "", "");
    return CallError(ErrorCause::kStoreFull,
                     "the server has no room for so many points; send fewer, or try again later")
        .RetryAfter(std::chrono::seconds(30));
  }
  if (data.size() < kSmallChunkBytes && !blocks_.empty() &&
      blocks_.back().size() + data.size() <= static_cast<size_t>(kMaxChunkBytes)) {
    blocks_.back().append(data);
  } else {
    blocks_.push_back(std::move(data));
  }
  return std::nullopt;
}

absl::Status IncomingScan::AppendToFile(const std::string& data) {
  if (!file_.valid()) {
    RILIEVO_ASSIGN_OR_RETURN(file_, UnnamedFile(folder_));
  }
  return file_.Write(data.data(), data.size());
}

std::optional<CallError> IncomingScan::CheckComplete() const {
  for (const Records* records : {&points_, &triangles_, &base_}) {
    if (auto error = records->CheckComplete()) return error;
  }
  return std::nullopt;
}

ScanBytes IncomingScan::Take() {
  points_.bytes = triangles_.bytes = base_.bytes = 0;
  if (file_.valid()) return ScanBytes(std::move(file_));
  return ScanBytes(std::exchange(blocks_, {}));
}

}  // namespace rilievo

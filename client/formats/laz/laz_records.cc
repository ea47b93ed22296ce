#include "client/formats/laz/laz_records.h"

#include <algorithm>

#include "absl/strings/str_cat.h"
#include "absl/strings/string_view.h"
#include "client/formats/laz/chunk_table.h"
#include "client/formats/laz/record_fields.h"
#include "core/base/status_macros.h"

namespace rilievo::laz {
namespace {

using Coding = LazParameters::Coding;

// Scanners need 2 to 10 bytes for a point. Points made up by a formula may need a hundredth, but a
// file of a few kilobytes must not fill the memory.
constexpr uint64_t kMostExpansion = 1000;                // bytes of records, by bytes read
constexpr uint64_t kFreeExpansion = uint64_t{64} << 20;  // bytes
constexpr uint64_t kCheckInterval = 1 << 16;             // points

}  // namespace

LazRecords::LazRecords(ByteSource* source, const LasHeader& header, const WantedLayers& wanted,
                       const LazParameters& parameters)
    : source_(source),
      header_(header),
      wanted_(wanted),
      parameters_(parameters),
      record_(header.record_size) {}

absl::StatusOr<std::unique_ptr<LazRecords>> LazRecords::Open(
    ByteSource* source, const LasHeader& header, const std::optional<std::string>& laszip,
    const WantedLayers& wanted) {
  RILIEVO_ASSIGN_OR_RETURN(const LazParameters parameters, ReadLazParameters(laszip, header));
  std::unique_ptr<LazRecords> records(new LazRecords(source, header, wanted, parameters));
  if (parameters.coding != Coding::kPointwise) RILIEVO_RETURN_IF_ERROR(records->ReadTable());
  return records;
}

absl::Status LazRecords::ReadTable() {
  const char* position = source_->Take(8);
  if (position == nullptr) return Lost("the file ends before its points; truncated file?");
  table_ = Load<int64_t>(position);
  if (parameters_.coding != Coding::kPointwiseChunks || parameters_.chunk_points > 0) {
    return absl::OkStatus();
  }
  const std::string_view rest = source_->Peek(std::string_view::npos);
  RILIEVO_ASSIGN_OR_RETURN(chunk_points_,
                           ReadChunkTable(rest, source_->position(), table_, header_.record_size));
  return absl::OkStatus();
}

absl::Status LazRecords::Lost(absl::string_view what) const {
  return absl::DataLossError(absl::StrCat("LAZ: chunk ", chunks_, ", point ", delivered_ + 1,
                                          " of ", header_.point_count, ": ", what));
}

const char* LazRecords::Next() {
  if (!status_.ok()) return nullptr;
  if (left_in_chunk_ == 0) {
    status_ = BeginChunk();
  } else if (pointwise_ ? !pointwise_->Decode(record_.data()) : !layered_->Decode(record_.data())) {
    status_ = Lost("the compressed bytes end too early or are damaged; truncated file?");
  } else if (delivered_ % kCheckInterval == 0) {
    status_ = CheckExpansion();
  }
  if (!status_.ok()) return nullptr;
  ++delivered_;
  if (--left_in_chunk_ == 0) status_ = EndChunk();
  return status_.ok() ? record_.data() : nullptr;
}

absl::Status LazRecords::BeginChunk() {
  ++chunks_;
  const char* first = source_->Take(record_.size());
  if (first == nullptr) return Lost("the file ends; truncated file?");
  std::copy_n(first, record_.size(), record_.begin());
  if (parameters_.coding == Coding::kLayeredChunks) return BeginLayeredChunk();
  return BeginPointwiseChunk();
}

absl::Status LazRecords::BeginPointwiseChunk() {
  left_in_chunk_ = header_.point_count - delivered_;
  if (!chunk_points_.empty()) {
    if (chunks_ > chunk_points_.size()) return Lost("the chunk table has no such chunk");
    left_in_chunk_ = std::min<uint64_t>(left_in_chunk_, chunk_points_[chunks_ - 1]);
  } else if (parameters_.coding == Coding::kPointwiseChunks) {
    left_in_chunk_ = std::min<uint64_t>(left_in_chunk_, parameters_.chunk_points);
  }
  pointwise_.emplace(parameters_, record_.data(), source_);
  return absl::OkStatus();
}

absl::Status LazRecords::BeginLayeredChunk() {
  auto chunk = LayeredChunk::Read(parameters_, wanted_, record_.data(), source_);
  if (!chunk.ok()) return Lost(chunk.status().message());
  layered_ = *std::move(chunk);
  left_in_chunk_ = layered_->point_count();
  const uint64_t left = header_.point_count - delivered_;
  if (left_in_chunk_ <= left) return absl::OkStatus();
  return Lost(absl::StrCat("the chunk has ", left_in_chunk_, " points, the header leaves ", left));
}

absl::Status LazRecords::EndChunk() {
  if (pointwise_) {
    pointwise_->End();
    pointwise_.reset();
  } else if (!layered_->at_end()) {
    return Lost("the points of the chunk do not use up its bytes; damaged file?");
  }
  return absl::OkStatus();
}

absl::Status LazRecords::CheckExpansion() const {
  const uint64_t records = delivered_ * header_.record_size;
  if (records <= kFreeExpansion + kMostExpansion * source_->position()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("LAZ: ", delivered_, " points in ", source_->position(), " bytes, more than ",
                   kMostExpansion, " to 1; give the scan as LAS if it is one"));
}

absl::Status LazRecords::CheckEnd() const {
  // A table at byte -1 is told of at the end of the file; one at the first byte was never written.
  const bool known = parameters_.coding != Coding::kPointwise && table_ != -1 &&
                     static_cast<uint64_t>(table_) != header_.point_offset;
  if (!known || static_cast<uint64_t>(table_) == source_->position()) return absl::OkStatus();
  return absl::DataLossError(
      absl::StrCat("LAZ: the ", header_.point_count, " points end at byte ", source_->position(),
                   ", but the chunk table behind them begins at byte ", table_, "; damaged file?"));
}

}  // namespace rilievo::laz

#include "client/formats/e57/section_reader.h"

#include <algorithm>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/formats/scalar_type.h"
#include "core/base/status_macros.h"

namespace rilievo::e57 {
namespace {

constexpr size_t kSectionHeader = 32;
constexpr uint8_t kCompressedVector = 1;  // kind of a section
// Kinds of packets.
constexpr uint8_t kIndexPacket = 0, kDataPacket = 1, kEmptyPacket = 2;
constexpr size_t kPacketStart = 4;  // kind, flags, size
constexpr size_t kDataHeader = 6;   // and the number of bytestreams
constexpr uint8_t kRestart = 1;     // a flag of data packets

}  // namespace

SectionReader::SectionReader(PagedFile* file, const ScanDescription& scan, std::vector<int> fields)
    : file_(file), scan_(&scan), fields_(std::move(fields)) {
  for (const int field : fields_) streams_.emplace_back(scan.fields[static_cast<size_t>(field)]);
}

template <typename... What>
absl::Status SectionReader::Lost(const What&... what) const {
  return absl::DataLossError(
      absl::StrCat("E57 ", scan_->name, ": ", what..., "; damaged file? copy or export it again"));
}

absl::StatusOr<SectionReader> SectionReader::Open(PagedFile* file, const ScanDescription& scan,
                                                  std::vector<int> fields) {
  SectionReader reader(file, scan, std::move(fields));
  RILIEVO_RETURN_IF_ERROR(reader.ReadHeader());
  RILIEVO_RETURN_IF_ERROR(reader.CheckCount());
  return reader;
}

absl::Status SectionReader::ReadHeader() {
  RILIEVO_ASSIGN_OR_RETURN(
      begin_, file_->Logical(scan_->section_offset, scan_->name + ": the section of points"));
  char header[kSectionHeader];
  RILIEVO_RETURN_IF_ERROR(file_->Read(begin_, sizeof(header), header));
  const auto kind = LoadAs<uint8_t>(header, false);
  if (kind != kCompressedVector) {
    return Lost("no points at byte ", scan_->section_offset, ": the section's kind is ", kind,
                ", it must be ", kCompressedVector);
  }
  const auto length = LoadAs<uint64_t>(header + 8, kSwapLittle);
  if (length < kSectionHeader || length > file_->logical_size() - begin_) {
    return Lost("its section of ", length, " bytes at byte ", scan_->section_offset,
                ", the file has ", file_->logical_size() - begin_, " there");
  }
  end_ = begin_ + length;
  RILIEVO_ASSIGN_OR_RETURN(at_, file_->Logical(LoadAs<uint64_t>(header + 16, kSwapLittle),
                                               scan_->name + ": the first packet"));
  if (at_ < begin_ + kSectionHeader || at_ >= end_) {
    return Lost("its first packet, at byte ", file_->Physical(at_), ", is outside its section");
  }
  return absl::OkStatus();
}

absl::Status SectionReader::CheckCount() const {
  uint64_t bits = 0;  // of a record
  for (const int field : fields_) bits += static_cast<uint64_t>(scan_->fields[field].bits);
  // At least one: records of constant fields take no bits, and their number would have no bound.
  bits = std::max<uint64_t>(bits, 1);
  const uint64_t most = 8 * size() / bits;
  if (scan_->record_count <= most) return absl::OkStatus();
  return Lost("recordCount is ", scan_->record_count, ", the ", size(),
              " bytes of its section hold at most ", most);
}

uint64_t SectionReader::available() const {
  uint64_t least = scan_->record_count - delivered_;
  for (const ValueStream& stream : streams_) least = std::min(least, stream.available());
  return least;
}

absl::StatusOr<size_t> SectionReader::Next(size_t most, std::vector<std::vector<double>>* values) {
  if (delivered_ == scan_->record_count) return 0;
  while (available() == 0) RILIEVO_RETURN_IF_ERROR(ReadPacket());
  const auto count = static_cast<size_t>(std::min<uint64_t>(most, available()));
  values->resize(streams_.size());
  for (size_t i = 0; i < streams_.size(); ++i) {
    (*values)[i].resize(count);
    streams_[i].Take(count, (*values)[i].data());
  }
  delivered_ += count;
  return count;
}

absl::Status SectionReader::ReadPacket() {
  if (end_ - at_ < kPacketStart) {
    return Lost("its section ends after ", delivered_, " of ", scan_->record_count, " points");
  }
  char start[kPacketStart];
  RILIEVO_RETURN_IF_ERROR(file_->Read(at_, sizeof(start), start));
  const auto kind = LoadAs<uint8_t>(start, false);
  const size_t size = size_t{LoadAs<uint16_t>(start + 2, kSwapLittle)} + 1;
  const uint64_t place = file_->Physical(at_);
  if (kind != kIndexPacket && kind != kDataPacket && kind != kEmptyPacket) {
    return Lost("the packet at byte ", place, " is of kind ", kind,
                ", known are 0 (index), 1 (data) and 2 (empty)");
  }
  if (size < kPacketStart || size > end_ - at_) {
    return Lost("the packet at byte ", place, " has ", size, " bytes, ", kPacketStart, " to ",
                end_ - at_, " are possible");
  }
  if (kind == kDataPacket) {
    packet_.resize(size);
    RILIEVO_RETURN_IF_ERROR(file_->Read(at_, size, packet_.data()));
    RILIEVO_RETURN_IF_ERROR(TakeData());
  }
  at_ += size;
  return absl::OkStatus();
}

absl::Status SectionReader::TakeData() {
  const uint64_t place = file_->Physical(at_);
  const size_t count =
      packet_.size() < kDataHeader ? 0 : LoadAs<uint16_t>(&packet_[4], kSwapLittle);
  if (count != scan_->fields.size()) {
    return Lost("the packet at byte ", place, " has ", count, " bytestreams for ",
                scan_->fields.size(), " fields");
  }
  std::vector<size_t> begins(count + 1, kDataHeader + 2 * count);
  for (size_t i = 0; i < count && begins[0] <= packet_.size(); ++i) {
    begins[i + 1] = begins[i] + LoadAs<uint16_t>(&packet_[kDataHeader + 2 * i], kSwapLittle);
  }
  if (begins[count] > packet_.size()) {
    return Lost("the packet at byte ", place, " has ", packet_.size(),
                " bytes, its bytestreams need ", begins[count]);
  }
  for (size_t i = 0; i < streams_.size(); ++i) {
    ValueStream& stream = streams_[i];
    const auto field = static_cast<size_t>(fields_[i]);
    // The bits left over may be padding or the beginning of a value. No known writer sets the flag,
    // so there is nothing to tell them apart by.
    if ((packet_[1] & kRestart) != 0 && stream.holds_part()) {
      return Lost("the packet at byte ", place, " starts anew within a value of ",
                  scan_->fields[field].name, ", which is not supported");
    }
    stream.Append(packet_.data() + begins[field], begins[field + 1] - begins[field]);
  }
  return absl::OkStatus();
}

}  // namespace rilievo::e57

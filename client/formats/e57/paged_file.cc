#include "client/formats/e57/paged_file.h"

#include <algorithm>
#include <cstring>
#include <span>
#include <sstream>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/formats/scalar_type.h"
#include "core/base/status_macros.h"
#include "core/codec/bytes/crc32c.h"

namespace rilievo::e57 {
namespace {

// Table 1 of the standard.
constexpr size_t kHeaderSize = 48, kLengthOffset = 16;
constexpr size_t kChecksumSize = 4;
// Writers use 1024. The header may say otherwise; these bounds keep a block small.
constexpr uint64_t kLeastPage = 64, kMostPage = 1 << 20;
// Bytes to read ahead when pages are asked for in order.
constexpr uint64_t kBlock = 1 << 18;

template <typename... What>
absl::Status Lost(const What&... what) {
  return absl::DataLossError(absl::StrCat("E57: ", what...));
}

template <typename... What>
absl::Status Invalid(const What&... what) {
  return absl::InvalidArgumentError(absl::StrCat("E57 header: ", what...));
}

// The checksum is the only big-endian number in the file.
bool IsSound(const char* page, size_t size) {
  const size_t payload = size - kChecksumSize;
  const auto* bytes = reinterpret_cast<const uint8_t*>(page);
  return Crc32c(std::span<const uint8_t>(bytes, payload)) ==
         LoadAs<uint32_t>(page + payload, !kSwapLittle);
}

uint64_t SizeFrom(std::istream& in, std::istream::pos_type start) {
  in.seekg(0, std::ios::end);
  const std::istream::pos_type end = in.tellg();
  in.clear();
  return end == std::istream::pos_type(-1) || end < start ? 0 : static_cast<uint64_t>(end - start);
}

}  // namespace

absl::StatusOr<std::unique_ptr<PagedFile>> PagedFile::Open(std::istream& in) {
  std::unique_ptr<PagedFile> file(new PagedFile(in));
  file->start_ = in.tellg();
  if (file->start_ == std::istream::pos_type(-1)) {
    in.clear();
    file->ReadPipe();
  }
  RILIEVO_RETURN_IF_ERROR(file->ReadHeader());
  return file;
}

void PagedFile::ReadPipe() {
  std::string bytes;
  // Up to the length of the header, as nothing says that a pipe ends there.
  while (*in_ && (bytes.size() < kHeaderSize ||
                  bytes.size() < LoadAs<uint64_t>(bytes.data() + kLengthOffset, kSwapLittle))) {
    const size_t size = bytes.size();
    bytes.resize(size + kBlock);
    in_->read(bytes.data() + size, static_cast<std::streamsize>(kBlock));
    bytes.resize(size + static_cast<size_t>(in_->gcount()));
  }
  whole_ = std::make_unique<std::istringstream>(std::move(bytes));
  in_ = whole_.get();
  start_ = 0;
}

absl::Status PagedFile::ReadHeader() {
  const uint64_t held = SizeFrom(*in_, start_);
  char bytes[kHeaderSize];
  in_->seekg(start_);
  if (!in_->read(bytes, sizeof(bytes))) {
    return Lost("the file ends within its header; truncated file?");
  }
  if (std::memcmp(bytes, "ASTM-E57", 8) != 0) return Invalid("does not begin with ASTM-E57");
  const auto major = LoadAs<uint32_t>(bytes + 8, kSwapLittle);
  const auto minor = LoadAs<uint32_t>(bytes + 12, kSwapLittle);
  if (major != 1 || minor != 0) {
    return Invalid("version ", major, ".", minor, ", known is 1.0; export the scan as E57 1.0");
  }
  const auto length = LoadAs<uint64_t>(bytes + kLengthOffset, kSwapLittle);
  xml_offset_ = LoadAs<uint64_t>(bytes + 24, kSwapLittle);
  xml_length_ = LoadAs<uint64_t>(bytes + 32, kSwapLittle);
  page_size_ = LoadAs<uint64_t>(bytes + 40, kSwapLittle);
  if (page_size_ < kLeastPage || page_size_ > kMostPage) {
    return Invalid("pages of ", page_size_, " bytes, ", kLeastPage, " to ", kMostPage,
                   " are possible, 1024 is usual; damaged file? copy or export it again");
  }
  if (length > held) {
    return Lost("the header says ", length, " bytes, the file holds ", held,
                "; truncated file? copy or export it again");
  }
  pages_ = length / page_size_;
  if (pages_ == 0 || length % page_size_ != 0) {
    return Invalid(length, " bytes are not a number of pages of ", page_size_,
                   "; damaged file? copy or export it again");
  }
  return Read(0, kHeaderSize, bytes);  // for the checksum of the first page
}

absl::StatusOr<uint64_t> PagedFile::Logical(uint64_t physical, const std::string& what) const {
  const uint64_t in_page = physical % page_size_;
  if (physical / page_size_ >= pages_ || in_page >= page_payload()) {
    return Lost(what, " should begin at byte ", physical, ", which is ",
                in_page >= page_payload() ? "within a checksum" : "beyond the end",
                " of the file; damaged file? copy or export it again");
  }
  return physical / page_size_ * page_payload() + in_page;
}

absl::Status PagedFile::Read(uint64_t logical, size_t count, char* bytes) {
  if (logical > logical_size() || count > logical_size() - logical) {
    return Lost(
        "the file refers to bytes beyond its end; truncated file? copy or export "
        "it again");
  }
  while (count > 0) {
    const uint64_t page = logical / page_payload();
    if (page < block_begin_ || page >= block_begin_ + block_pages_) {
      RILIEVO_RETURN_IF_ERROR(LoadBlock(page));
    }
    const auto begin = static_cast<size_t>(logical - block_begin_ * page_payload());
    const auto end = static_cast<size_t>(block_pages_ * page_payload());
    const size_t step = std::min(count, end - begin);
    std::memcpy(bytes, block_.data() + begin, step);
    bytes += step;
    logical += step;
    count -= step;
  }
  return absl::OkStatus();
}

// Reads ahead, twice as far each time, where pages are asked for in order. A damaged page ends the
// block, so that it is an error only when it is asked for itself.
absl::Status PagedFile::LoadBlock(uint64_t page) {
  const bool in_order = page == block_begin_ + block_pages_;
  const uint64_t most = std::max<uint64_t>(1, kBlock / page_size_);
  next_block_pages_ = in_order ? std::min(2 * next_block_pages_, most) : 1;
  const auto wanted = static_cast<size_t>(std::min(next_block_pages_, pages_ - page));
  const auto size = static_cast<size_t>(page_size_);
  block_.resize(wanted * size);
  in_->clear();
  in_->seekg(start_ + static_cast<std::streamoff>(page * page_size_));
  in_->read(block_.data(), static_cast<std::streamsize>(block_.size()));
  const size_t held = static_cast<size_t>(in_->gcount()) / size;
  block_begin_ = page;
  block_pages_ = 0;
  for (size_t i = 0; i < held && IsSound(block_.data() + i * size, size); ++i, ++block_pages_) {
    std::memmove(block_.data() + i * (size - kChecksumSize), block_.data() + i * size,
                 size - kChecksumSize);
  }
  if (block_pages_ > 0) return absl::OkStatus();
  if (held == 0) return Lost("byte ", page * page_size_, " could not be read; truncated file?");
  return Lost("the page at byte ", page * page_size_,
              " does not agree with its checksum; the file is damaged: copy it again from where it "
              "came, or export it again");
}

}  // namespace rilievo::e57

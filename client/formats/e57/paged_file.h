// The bytes of an E57 file without the checksums between them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"

namespace rilievo::e57 {

// ASTM E2807-11 (see also D. Huber, "The ASTM E57 file format for 3D imaging data exchange", SPIE
// 7864, 2011): a file consists of pages, each of which ends with the CRC-32C of its other bytes.
// "Physical" offsets count all bytes; "logical" ones leave the checksums out.
class PagedFile {
 public:
  // Reads the header. `in` must outlive this. A stream that cannot seek, such as a pipe, is read
  // into memory first, because the XML section is at the end of the file. INVALID_ARGUMENT for a
  // file that is not E57 1.0, DATA_LOSS for one that is shorter than its header says.
  static absl::StatusOr<std::unique_ptr<PagedFile>> Open(std::istream& in);

  uint64_t logical_size() const { return pages_ * page_payload(); }
  uint64_t xml_offset() const { return xml_offset_; }  // physical
  uint64_t xml_length() const { return xml_length_; }  // logical

  // DATA_LOSS where `physical` is outside the file or within a checksum; the message begins with
  // `what`.
  absl::StatusOr<uint64_t> Logical(uint64_t physical, const std::string& what) const;
  // For messages.
  uint64_t Physical(uint64_t logical) const {
    return logical / page_payload() * page_size_ + logical % page_payload();
  }

  // Copies the bytes from `logical` on. DATA_LOSS for a damaged page, with its physical offset, and
  // for bytes beyond the end.
  absl::Status Read(uint64_t logical, size_t count, char* bytes);

 private:
  explicit PagedFile(std::istream& in) : in_(&in) {}

  uint64_t page_payload() const { return page_size_ - 4; }
  void ReadPipe();
  absl::Status ReadHeader();
  absl::Status LoadBlock(uint64_t page);

  std::istream* in_;
  std::unique_ptr<std::istream> whole_;  // of a pipe
  std::istream::pos_type start_;
  uint64_t page_size_ = 0, pages_ = 0;
  uint64_t xml_offset_ = 0, xml_length_ = 0;

  std::vector<char> block_;  // payloads of sound pages, one after another
  uint64_t block_begin_ = 0, block_pages_ = 0, next_block_pages_ = 1;
};

}  // namespace rilievo::e57

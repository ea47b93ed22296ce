// The records of one scan.
#pragma once

#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "absl/status/statusor.h"
#include "client/formats/e57/paged_file.h"
#include "client/formats/e57/scan_description.h"
#include "client/formats/e57/value_stream.h"

namespace rilievo::e57 {

// The binary section of a CompressedVector of ASTM E2807-11: a header, then data packets that
// each hold a piece of every field's bytestream, with index packets and empty ones in between,
// which are passed over. What a packet holds of fields that are not read is left alone.
class SectionReader {
 public:
  // `fields`: the numbers of the fields to read. `file` and `scan` must outlive this. DATA_LOSS for
  // a damaged section, or one whose bytes cannot hold the records that the scan announces.
  static absl::StatusOr<SectionReader> Open(PagedFile* file, const ScanDescription& scan,
                                            std::vector<int> fields);

  uint64_t size() const { return end_ - begin_; }  // logical bytes

  // The next records, at most `most` and at least one: their number, 0 after the last of them.
  // values[i] gets those of the i-th field. DATA_LOSS, with the place and the number of the records
  // read, where the section is damaged or ends too early.
  absl::StatusOr<size_t> Next(size_t most, std::vector<std::vector<double>>* values);

 private:
  SectionReader(PagedFile* file, const ScanDescription& scan, std::vector<int> fields);

  absl::Status ReadHeader();
  absl::Status CheckCount() const;
  absl::Status ReadPacket();
  absl::Status TakeData();
  uint64_t available() const;
  template <typename... What>
  absl::Status Lost(const What&... what) const;

  PagedFile* file_;
  const ScanDescription* scan_;
  std::vector<int> fields_;
  std::vector<ValueStream> streams_;  // of `fields_`
  uint64_t begin_ = 0, end_ = 0;      // logical
  uint64_t at_ = 0;                   // the next packet, logical
  uint64_t delivered_ = 0;
  std::vector<char> packet_;
};

}  // namespace rilievo::e57

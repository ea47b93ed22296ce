// The body of a PLY file, element by element.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/byte_source.h"
#include "client/formats/ply_header.h"

namespace rilievo {

// Walks the `count` instances of one element. Only the wanted properties are converted; the others
// are passed over, at the right length whatever lists they hold.
class PlyElementReader {
 public:
  // All arguments outlive the reader. `scalars`: indices of scalar properties to convert; `list`:
  // index of one list property to convert, or -1.
  PlyElementReader(ByteSource* source, const PlyHeader& header, const PlyElement& element,
                   std::span<const int> scalars, int list);

  // Reads the next instance; at most element.count times. DATA_LOSS when the bytes end,
  // INVALID_ARGUMENT for a bad number or list count; both name element, instance and line.
  absl::Status Next();

  // Of the instance read last, in the order of `scalars`.
  const double* scalars() const { return values_.data(); }
  const std::vector<double>& list() const { return list_; }

 private:
  struct Column {
    ScalarType type, count_type;
    bool is_list;
    int slot;  // in values_; -1: passed over. For a list: 0 wanted, -1 not
    size_t offset;
  };

  absl::Status NextAscii();
  absl::Status NextFixed();
  absl::Status NextWithLists();
  absl::Status ReadList(const Column& column, size_t index);
  absl::Status Truncated() const;
  absl::Status Error(size_t column, absl::string_view what) const;

  ByteSource* source_;
  const PlyElement& element_;
  const bool ascii_, swap_;
  std::vector<Column> columns_;
  std::vector<Column> wanted_;
  bool has_list_ = false;
  size_t stride_ = 0;           // of an instance without lists
  const char* rows_ = nullptr;  // of the block at hand
  uint64_t rows_left_ = 0;
  uint64_t instance_ = 0;  // read so far
  std::vector<double> values_, list_;
};

// Passes over all instances of an element.
absl::Status SkipPlyElement(ByteSource* source, const PlyHeader& header, const PlyElement& element);

}  // namespace rilievo

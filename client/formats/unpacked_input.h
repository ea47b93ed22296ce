// Files that are compressed as a whole (gzip, zstd), as the bytes that they hold.
#pragma once

#include <cstdint>
#include <istream>
#include <memory>
#include <optional>
#include <streambuf>

#include "absl/status/status.h"
#include "client/formats/file_kind.h"
#include "client/formats/open_input.h"

namespace rilievo {

// Bounds what a small file may grow to. A scan as text takes 3 to 20 times its compressed size.
struct UnpackLimits {
  uint64_t any_file = uint64_t{64} << 20;  // bytes that every file may hold
  uint64_t per_byte = 100;                 // and so many more for each compressed byte
};

// Inflates while it is read. zlib's gzip members and zstd's frames may follow one another; what a
// frame of zstd wants to look back on is bounded by the library (128 MiB).
class UnpackedInput {
 public:
  // `packed` must outlive this; `size`: of it in bytes, 0 if unknown.
  UnpackedInput(std::istream& packed, Packing packing, uint64_t size,
                const UnpackLimits& limits = {});
  ~UnpackedInput();

  // Cannot seek. Ends early where the data breaks off; status() says so.
  std::istream& stream() { return *stream_; }

  // DATA_LOSS for a stream that ends too early or is damaged, INVALID_ARGUMENT for one that holds
  // more than the limits allow.
  const absl::Status& status() const;
  // Reads what is left, so that its checksums are looked at too, and gives the status.
  const absl::Status& Finish();

 private:
  class Buffer;
  std::unique_ptr<Buffer> buffer_;
  std::unique_ptr<std::istream> stream_;
};

// read(std::istream&) on what `in` holds, which is unpacked if it begins like a compressed file.
// Where the stream is damaged, that is the error, whatever `read` made of it.
template <typename Read>
auto WithUnpacked(std::istream& in, Read read) -> decltype(read(in)) {
  HeadedInput input(in);
  const std::optional<Packing> packing = PackingOf(input.head());
  if (!packing) return read(input.stream());
  UnpackedInput unpacked(input.stream(), *packing, input.size());
  auto result = read(unpacked.stream());
  const absl::Status& status = result.ok() ? unpacked.Finish() : unpacked.status();
  if (!status.ok()) return status;
  return result;
}

}  // namespace rilievo

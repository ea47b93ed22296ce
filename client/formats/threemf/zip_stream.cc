#include "client/formats/threemf/zip_stream.h"

#include <algorithm>
#include <limits>
#include <new>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

constexpr size_t kBlockBytes = size_t{1} << 16;
// Names of the format: sections 4.3.7, 4.3.9, 4.3.12 and 4.3.16.
constexpr uint32_t kLocalHeader = 0x04034b50, kDescriptor = 0x08074b50, kDirectory = 0x02014b50,
                   kEndOfDirectory = 0x06054b50;
constexpr uint16_t kVersion = 20, kSizesFollow = 1 << 3, kDeflated = 8;
constexpr uint16_t kFirstDay = 0x21;  // 1 January 1980: the same bytes at any time

template <typename... Values>
std::string LittleEndian(Values... values) {
  std::string bytes;
  const auto append = [&](auto value) {
    for (size_t i = 0; i < sizeof(value); ++i) {
      bytes += static_cast<char>(static_cast<uint64_t>(value) >> (8 * i) & 0xff);
    }
  };
  (append(values), ...);
  return bytes;
}

uint16_t Short(size_t value) { return static_cast<uint16_t>(value); }
uint32_t Long(uint64_t value) { return static_cast<uint32_t>(value); }

}  // namespace

ZipStream::ZipStream(std::ostream& out) : out_(out), block_(kBlockBytes) {
  constexpr int kRaw = -15;  // the largest window, without a header of zlib's
  constexpr int kMemory = 8;
  if (deflateInit2(&deflate_, Z_DEFAULT_COMPRESSION, Z_DEFLATED, kRaw, kMemory,
                   Z_DEFAULT_STRATEGY) != Z_OK) {
    throw std::bad_alloc();
  }
}

ZipStream::~ZipStream() { deflateEnd(&deflate_); }

void ZipStream::Write(std::string_view bytes) {
  out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  written_ += bytes.size();
}

void ZipStream::Begin(const std::string& name) {
  End();
  is_open_ = true;
  entries_.push_back({name, 0, written_, 0, 0});
  deflateReset(&deflate_);
  // Checksum and sizes come behind the bytes.
  Write(LittleEndian(kLocalHeader, kVersion, kSizesFollow, kDeflated, uint16_t{0}, kFirstDay,
                     uint32_t{0}, uint32_t{0}, uint32_t{0}, Short(name.size()), uint16_t{0}));
  Write(name);
}

void ZipStream::Deflate(std::string_view bytes, int flush) {
  deflate_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(bytes.data()));
  deflate_.avail_in = static_cast<uInt>(bytes.size());
  do {
    deflate_.next_out = reinterpret_cast<Bytef*>(block_.data());
    deflate_.avail_out = static_cast<uInt>(block_.size());
    deflate(&deflate_, flush);
    const size_t count = block_.size() - deflate_.avail_out;
    entries_.back().packed += count;
    Write({block_.data(), count});
  } while (deflate_.avail_out == 0);
}

void ZipStream::Append(std::string_view bytes) {
  Entry& entry = entries_.back();
  while (!bytes.empty()) {
    const std::string_view part = bytes.substr(0, kBlockBytes);
    entry.checksum = Long(crc32(entry.checksum, reinterpret_cast<const Bytef*>(part.data()),
                                static_cast<uInt>(part.size())));
    entry.unpacked += part.size();
    Deflate(part, Z_NO_FLUSH);
    bytes.remove_prefix(part.size());
  }
}

void ZipStream::End() {
  if (!is_open_) return;
  is_open_ = false;
  Deflate({}, Z_FINISH);
  const Entry& entry = entries_.back();
  Write(LittleEndian(kDescriptor, entry.checksum, Long(entry.packed), Long(entry.unpacked)));
}

absl::Status ZipStream::Finish() {
  End();
  const uint64_t directory = written_;
  uint64_t largest = directory;
  for (const Entry& entry : entries_) {
    largest = std::max(largest, entry.unpacked);
    Write(LittleEndian(kDirectory, kVersion, kVersion, kSizesFollow, kDeflated, uint16_t{0},
                       kFirstDay, entry.checksum, Long(entry.packed), Long(entry.unpacked),
                       Short(entry.name.size()), uint16_t{0}, uint16_t{0}, uint16_t{0}, uint16_t{0},
                       uint32_t{0}, Long(entry.offset)));
    Write(entry.name);
  }
  const uint64_t end = written_;
  const uint16_t count = Short(entries_.size());
  Write(LittleEndian(kEndOfDirectory, uint16_t{0}, uint16_t{0}, count, count, Long(end - directory),
                     Long(directory), uint16_t{0}));
  if (largest <= std::numeric_limits<uint32_t>::max()) return absl::OkStatus();
  return absl::InvalidArgumentError(
      absl::StrCat("an archive holds at most 4 GiB, this one would take ", largest, " bytes"));
}

}  // namespace rilievo

#include "client/formats/unpacked_input.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <array>
#include <string>
#include <vector>

#include "absl/strings/str_cat.h"
#include "core/base/status_macros.h"

namespace rilievo {

constexpr size_t kInflateBlock = size_t{1} << 18;

// What a call of a library has used of its input and written.
struct InflateProgress {
  size_t consumed = 0, produced = 0;
  bool between = false;  // a member or frame is complete and no other has begun
};

// Not in the unnamed namespace, because UnpackedInput::Buffer has a member of this type.
class Inflater {
 public:
  virtual ~Inflater() = default;
  // An error is what the library says of damaged input.
  virtual absl::StatusOr<InflateProgress> Inflate(const char* in, size_t in_size, char* out,
                                                  size_t out_size) = 0;
};

namespace {

class GzipInflater : public Inflater {
 public:
  GzipInflater() { ready_ = inflateInit2(&stream_, MAX_WBITS + 16) == Z_OK; }
  ~GzipInflater() override { inflateEnd(&stream_); }

  absl::StatusOr<InflateProgress> Inflate(const char* in, size_t in_size, char* out,
                                          size_t out_size) override {
    if (!ready_) return absl::ResourceExhaustedError("no memory to unpack it");
    stream_.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(in));
    stream_.avail_in = static_cast<uInt>(in_size);
    stream_.next_out = reinterpret_cast<Bytef*>(out);
    stream_.avail_out = static_cast<uInt>(out_size);
    const int code = inflate(&stream_, Z_NO_FLUSH);
    // Z_BUF_ERROR: there was nothing to do.
    if (code != Z_OK && code != Z_STREAM_END && code != Z_BUF_ERROR) {
      return absl::DataLossError(stream_.msg != nullptr ? stream_.msg : zError(code));
    }
    InflateProgress progress{in_size - stream_.avail_in, out_size - stream_.avail_out,
                             code == Z_STREAM_END};
    if (code == Z_STREAM_END) inflateReset(&stream_);
    return progress;
  }

 private:
  z_stream stream_{};
  bool ready_ = false;
};

class ZstdInflater : public Inflater {
 public:
  ~ZstdInflater() override { ZSTD_freeDStream(stream_); }

  absl::StatusOr<InflateProgress> Inflate(const char* in, size_t in_size, char* out,
                                          size_t out_size) override {
    if (stream_ == nullptr) return absl::ResourceExhaustedError("no memory to unpack it");
    ZSTD_inBuffer input{in, in_size, 0};
    ZSTD_outBuffer output{out, out_size, 0};
    const size_t code = ZSTD_decompressStream(stream_, &output, &input);
    if (ZSTD_isError(code)) return absl::DataLossError(ZSTD_getErrorName(code));
    return InflateProgress{input.pos, output.pos, code == 0};
  }

 private:
  ZSTD_DStream* stream_ = ZSTD_createDStream();
};

std::unique_ptr<Inflater> InflaterOf(Packing packing) {
  if (packing == Packing::kGzip) return std::make_unique<GzipInflater>();
  return std::make_unique<ZstdInflater>();
}

}  // namespace

class UnpackedInput::Buffer : public std::streambuf {
 public:
  Buffer(std::istream& packed, Packing packing, uint64_t size, const UnpackLimits& limits)
      : packed_(packed),
        name_(packing == Packing::kGzip ? "gzip" : "zstd"),
        unpack_(packing == Packing::kGzip ? "gunzip" : "unzstd"),
        size_(size),
        limits_(limits),
        inflater_(InflaterOf(packing)) {}

  const absl::Status& status() const { return status_; }

  const absl::Status& Finish() {
    while (underflow() != traits_type::eof()) setg(out_.data(), out_.data(), out_.data());
    return status_;
  }

 protected:
  int_type underflow() override {
    if (gptr() != egptr()) return traits_type::to_int_type(*gptr());
    size_t produced = 0;
    while (status_.ok() && produced == 0) {
      // A full block may have left something inside the library.
      if (begin_ == end_ && !was_full_ && !ReadBlock()) break;
      produced = Step();
    }
    setg(out_.data(), out_.data(), out_.data() + produced);
    return produced > 0 ? traits_type::to_int_type(out_.front()) : traits_type::eof();
  }

 private:
  // False at the end of the compressed bytes, which must not be within a frame.
  bool ReadBlock() {
    packed_.read(in_.data(), static_cast<std::streamsize>(in_.size()));
    begin_ = 0;
    end_ = static_cast<size_t>(packed_.gcount());
    read_ += end_;
    if (end_ > 0) return true;
    if (!between_) {
      status_ = absl::DataLossError(absl::StrCat(name_, ": the compressed data break off after ",
                                                 read_, " bytes; truncated file? copy it again"));
    }
    return false;
  }

  size_t Step() {
    const absl::StatusOr<InflateProgress> progress =
        inflater_->Inflate(in_.data() + begin_, end_ - begin_, out_.data(), out_.size());
    if (!progress.ok()) {
      status_ = absl::Status(
          progress.status().code(),
          absl::StrCat(name_, ": the compressed data are damaged before byte ", read_, " (",
                       progress.status().message(), "); copy or compress the file again"));
      return 0;
    }
    begin_ += progress->consumed;
    if (progress->consumed > 0 || progress->produced > 0) between_ = progress->between;
    was_full_ = progress->produced == out_.size();
    written_ += progress->produced;
    const uint64_t most = limits_.any_file + limits_.per_byte * std::max(size_, read_);
    if (written_ <= most) return progress->produced;
    status_ = absl::InvalidArgumentError(absl::StrCat(
        name_, ": inflates to more than ", most, " bytes, the limit for a compressed file of ",
        std::max(size_, read_), "; if it is what it should be, unpack it first (", unpack_, ")"));
    return 0;
  }

  std::istream& packed_;
  const char *name_, *unpack_;
  const uint64_t size_;
  const UnpackLimits limits_;
  std::unique_ptr<Inflater> inflater_;
  std::vector<char> in_ = std::vector<char>(kInflateBlock), out_ = std::vector<char>(kInflateBlock);
  size_t begin_ = 0, end_ = 0;       // of in_, what is not consumed
  uint64_t read_ = 0, written_ = 0;  // bytes
  bool between_ = false, was_full_ = false;
  absl::Status status_;
};

UnpackedInput::UnpackedInput(std::istream& packed, Packing packing, uint64_t size,
                             const UnpackLimits& limits)
    : buffer_(std::make_unique<Buffer>(packed, packing, size, limits)),
      stream_(std::make_unique<std::istream>(buffer_.get())) {}

UnpackedInput::~UnpackedInput() = default;

const absl::Status& UnpackedInput::status() const { return buffer_->status(); }

const absl::Status& UnpackedInput::Finish() { return buffer_->Finish(); }

}  // namespace rilievo

// Buffered bytes of a stream that knows, when it can be known, how many are left.
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <optional>
#include <string_view>
#include <vector>

namespace rilievo {

// The one way the readers of this folder see a file. Nothing is allocated beyond the bytes that
// really arrived and one block, whatever a header claims.
class ByteSource {
 public:
  // Longest line that NextLine() accepts.
  static constexpr size_t kMaxLine = size_t{1} << 20;

  // `in` must outlive the source. Its size is taken from seeking; a pipe has none.
  explicit ByteSource(std::istream& in);

  // Bytes not yet consumed; nullopt for a pipe.
  std::optional<uint64_t> remaining() const;
  // False only when it is known that fewer than `count` bytes are left.
  bool MayHold(uint64_t count) const { return !remaining() || count <= *remaining(); }

  // Bytes consumed since the source was made.
  uint64_t position() const { return read_ - buffered(); }

  enum class Line { kRead, kEnd, kTooLong };
  // The next line without its LF or CRLF, valid until the next call of any method here.
  Line NextLine(std::string_view* line);
  // Number of the line that NextLine() gave last, from 1.
  int64_t line_number() const { return line_number_; }
  // Whether that line was closed by a line end rather than by the end of the bytes.
  bool line_was_ended() const { return line_was_ended_; }

  // The next `count` bytes, contiguous and valid until the next call, or nullptr (and nothing
  // consumed) when the source ends before.
  const char* Take(size_t count);
  // False when the source ends before `count` bytes are passed.
  bool Skip(uint64_t count);
  // Up to `count` bytes ahead, not consumed.
  std::string_view Peek(size_t count);

 private:
  size_t buffered() const { return end_ - begin_; }
  // Buffers at least `count` bytes if they exist; grows by what arrives.
  bool Fill(size_t count);
  bool ReadBlock();

  std::istream& in_;
  std::vector<char> buffer_;
  size_t begin_ = 0, end_ = 0;
  uint64_t read_ = 0;               // bytes taken from the stream
  std::optional<uint64_t> unread_;  // bytes still in the stream
  int64_t line_number_ = 0;
  bool line_was_ended_ = true;
};

}  // namespace rilievo

#include "client/formats/byte_source.h"

#include <algorithm>
#include <cstring>

namespace rilievo {
namespace {

constexpr size_t kBlock = size_t{1} << 18;
constexpr size_t kSmallBlock = size_t{1} << 12;  // of small files, and of those that grow

std::optional<uint64_t> SizeBySeeking(std::istream& in) {
  const std::istream::pos_type here = in.tellg();
  if (here == std::istream::pos_type(-1)) {
    in.clear();
    return std::nullopt;
  }
  in.seekg(0, std::ios::end);
  const std::istream::pos_type end = in.tellg();
  in.clear();
  in.seekg(here);
  if (end == std::istream::pos_type(-1) || end < here) return std::nullopt;
  return static_cast<uint64_t>(end - here);
}

}  // namespace

ByteSource::ByteSource(std::istream& in) : in_(in), unread_(SizeBySeeking(in)) {}

std::optional<uint64_t> ByteSource::remaining() const {
  if (!unread_) return std::nullopt;
  return *unread_ + buffered();
}

bool ByteSource::ReadBlock() {
  if (begin_ > 0) {
    std::memmove(buffer_.data(), buffer_.data() + begin_, buffered());
    end_ -= begin_;
    begin_ = 0;
  }
  const size_t block =
      unread_ ? static_cast<size_t>(std::clamp<uint64_t>(*unread_ + 1, kSmallBlock, kBlock))
              : kBlock;
  if (buffer_.size() < end_ + block) buffer_.resize(end_ + block);
  in_.read(buffer_.data() + end_, static_cast<std::streamsize>(block));
  const size_t count = static_cast<size_t>(in_.gcount());
  end_ += count;
  read_ += count;
  // A file that shrinks while it is read must not leave bytes promised that will never come.
  if (unread_) *unread_ = count < block ? 0 : *unread_ - std::min<uint64_t>(*unread_, count);
  return count > 0;
}

bool ByteSource::Fill(size_t count) {
  while (buffered() < count) {
    if (!ReadBlock()) return false;
  }
  return true;
}

ByteSource::Line ByteSource::NextLine(std::string_view* line) {
  size_t searched = 0;
  for (;;) {
    const char* start = buffer_.data() + begin_;
    const void* found = buffered() > searched
                            ? std::memchr(start + searched, '\n', buffered() - searched)
                            : nullptr;
    if (found != nullptr || buffered() > kMaxLine) {
      const size_t length = found ? static_cast<const char*>(found) - start : buffered();
      if (length > kMaxLine) return Line::kTooLong;
      begin_ += length + 1;
      ++line_number_;
      line_was_ended_ = true;
      *line =
          std::string_view(start, length > 0 && start[length - 1] == '\r' ? length - 1 : length);
      return Line::kRead;
    }
    searched = buffered();
    if (ReadBlock()) continue;
    if (buffered() == 0) return Line::kEnd;
    *line = std::string_view(buffer_.data() + begin_, buffered());
    if (line->back() == '\r') line->remove_suffix(1);
    begin_ = end_;
    ++line_number_;
    line_was_ended_ = false;
    return Line::kRead;
  }
}

const char* ByteSource::Take(size_t count) {
  if (!MayHold(count) || !Fill(count)) return nullptr;
  const char* bytes = buffer_.data() + begin_;
  begin_ += count;
  return bytes;
}

bool ByteSource::Skip(uint64_t count) {
  if (!MayHold(count)) return false;
  while (count > 0) {
    if (buffered() == 0 && !ReadBlock()) return false;
    const size_t step = static_cast<size_t>(std::min<uint64_t>(count, buffered()));
    begin_ += step;
    count -= step;
  }
  return true;
}

std::string_view ByteSource::Peek(size_t count) {
  Fill(count);
  return {buffer_.data() + begin_, std::min(count, buffered())};
}

}  // namespace rilievo

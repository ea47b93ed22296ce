#include "client/formats/lzf.h"

#include <algorithm>

#include "absl/strings/str_cat.h"

namespace rilievo {
namespace {

// A control byte below 32 starts a run of control + 1 literals. Else its upper three bits are the
// length minus two (7: plus the next byte) and its lower five the upper bits of the distance minus
// one, whose lower byte comes last.
constexpr size_t kMaxLiterals = 32, kMaxDistance = 8192, kMaxMatch = 264, kMinMatch = 3;

absl::Status Damaged(size_t at, absl::string_view what) {
  return absl::DataLossError(absl::StrCat("LZF data, byte ", at, ": ", what));
}

void AppendLiterals(std::string_view literals, std::vector<char>* out) {
  while (!literals.empty()) {
    const size_t run = std::min(literals.size(), kMaxLiterals);
    out->push_back(static_cast<char>(run - 1));
    out->insert(out->end(), literals.begin(), literals.begin() + static_cast<std::ptrdiff_t>(run));
    literals.remove_prefix(run);
  }
}

}  // namespace

absl::StatusOr<std::vector<char>> DecodeLzf(std::string_view compressed, uint64_t size) {
  if (size / kMaxLzfRatio > compressed.size()) {
    return Damaged(0, absl::StrCat("claims ", size, " bytes, ", compressed.size(),
                                   " compressed bytes cannot hold them"));
  }
  std::vector<char> out;
  out.reserve(size);
  size_t at = 0;
  while (at < compressed.size()) {
    const size_t control = static_cast<uint8_t>(compressed[at++]);
    if (control < 32) {
      const size_t run = control + 1;
      if (run > compressed.size() - at) return Damaged(at, "a literal run is cut short");
      if (run > size - out.size()) return Damaged(at, "more bytes than announced");
      out.insert(out.end(), compressed.begin() + static_cast<std::ptrdiff_t>(at),
                 compressed.begin() + static_cast<std::ptrdiff_t>(at + run));
      at += run;
      continue;
    }
    size_t length = control >> 5;
    if (compressed.size() - at < (length == 7 ? 2u : 1u)) {
      return Damaged(at, "a back reference is cut short");
    }
    if (length == 7) length += static_cast<uint8_t>(compressed[at++]);
    length += 2;
    const size_t distance = ((control & 31) << 8 | static_cast<uint8_t>(compressed[at++])) + 1;
    if (distance > out.size()) return Damaged(at, "refers to before the start");
    if (length > size - out.size()) return Damaged(at, "more bytes than announced");
    // Source and target may overlap: a run repeats itself.
    for (size_t i = 0; i < length; ++i) out.push_back(out[out.size() - distance]);
  }
  if (out.size() != size) {
    return Damaged(at, absl::StrCat("gives ", out.size(), " bytes, ", size, " announced"));
  }
  return out;
}

std::vector<char> EncodeLzf(std::string_view bytes) {
  std::vector<char> out;
  std::vector<size_t> last_seen(1 << 14, SIZE_MAX);
  size_t literal_begin = 0, at = 0;
  while (at + kMinMatch <= bytes.size()) {
    const uint32_t key = static_cast<uint8_t>(bytes[at]) << 16 |
                         static_cast<uint8_t>(bytes[at + 1]) << 8 |
                         static_cast<uint8_t>(bytes[at + 2]);
    size_t& slot = last_seen[key * 2654435761u >> 18];
    const size_t candidate = slot;
    slot = at;
    size_t length = 0;
    if (candidate < at && at - candidate <= kMaxDistance) {
      const size_t longest = std::min(kMaxMatch, bytes.size() - at);
      while (length < longest && bytes[candidate + length] == bytes[at + length]) ++length;
    }
    if (length < kMinMatch) {
      ++at;
      continue;
    }
    AppendLiterals(bytes.substr(literal_begin, at - literal_begin), &out);
    const size_t distance = at - candidate - 1, code = length - 2;
    out.push_back(static_cast<char>(std::min<size_t>(code, 7) << 5 | distance >> 8));
    if (code >= 7) out.push_back(static_cast<char>(code - 7));
    out.push_back(static_cast<char>(distance & 255));
    at += length;
    literal_begin = at;
  }
  AppendLiterals(bytes.substr(literal_begin), &out);
  return out;
}

}  // namespace rilievo

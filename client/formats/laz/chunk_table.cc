#include "client/formats/laz/chunk_table.h"

#include "absl/status/status.h"
#include "absl/strings/str_cat.h"
#include "client/formats/laz/arithmetic_decoder.h"
#include "client/formats/laz/integer_decoder.h"
#include "client/formats/laz/record_fields.h"

namespace rilievo::laz {
namespace {

constexpr size_t kTableHeader = 8;  // version, number of chunks

template <typename... What>
absl::Status Lost(const What&... what) {
  return absl::DataLossError(absl::StrCat("LAZ chunk table: ", what...));
}

}  // namespace

absl::StatusOr<std::vector<uint32_t>> ReadChunkTable(std::string_view file, uint64_t begin,
                                                     int64_t table, size_t record_size) {
  if (table == -1 && file.size() >= 8) table = Load<int64_t>(file.data() + file.size() - 8);
  const uint64_t end = begin + file.size();
  if (table < 0 || static_cast<uint64_t>(table) < begin ||
      static_cast<uint64_t>(table) + kTableHeader > end) {
    return Lost("it should begin at byte ", table, " of the file, whose chunks begin at byte ",
                begin, " and which ends at byte ", end, "; truncated file?");
  }
  const auto chunk_bytes = static_cast<size_t>(static_cast<uint64_t>(table) - begin);
  const auto version = Load<uint32_t>(file.data() + chunk_bytes);
  const auto count = Load<uint32_t>(file.data() + chunk_bytes + 4);
  if (version != 0) return Lost("version ", version, ", known is 0");
  if (count > chunk_bytes / record_size) {
    return Lost(count, " chunks in ", chunk_bytes, " bytes, each begins with a point of ",
                record_size);
  }
  ArithmeticDecoder decoder;
  decoder.Start(file.substr(chunk_bytes + kTableHeader));
  IntegerDecoder numbers(32, 2);
  std::vector<uint32_t> points;
  uint32_t last = 0;
  for (uint32_t i = 0; i < count; ++i) {
    last += numbers.Decode(&decoder, 0);
    numbers.Decode(&decoder, 1);  // its bytes
    if (decoder.failed()) return Lost("cut off or damaged at chunk ", i + 1, " of ", count);
    if (last == 0) return Lost("chunk ", i + 1, " of ", count, " has 0 points");
    points.push_back(last);
  }
  return points;
}

}  // namespace rilievo::laz

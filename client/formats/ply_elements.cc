#include "client/formats/ply_elements.h"

#include <algorithm>
#include <bit>

#include "absl/strings/str_cat.h"
#include "client/formats/number_text.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

constexpr size_t kRowBlockBytes = size_t{1} << 16;

// A list count as it stands in the file, or nothing for a negative one.
bool CountFromScalar(double value, uint64_t* count) {
  if (!(value >= 0) || value >= 0x1p63) return false;
  *count = static_cast<uint64_t>(value);
  return true;
}

bool NeedsSwap(PlyHeader::Format format) {
  const bool little = std::endian::native == std::endian::little;
  return format == (little ? PlyHeader::Format::kBigEndian : PlyHeader::Format::kLittleEndian);
}

}  // namespace

PlyElementReader::PlyElementReader(ByteSource* source, const PlyHeader& header,
                                   const PlyElement& element, std::span<const int> scalars,
                                   int list)
    : source_(source), element_(element), ascii_(header.ascii()), swap_(NeedsSwap(header.format)) {
  values_.resize(scalars.size());
  for (size_t i = 0; i < element.properties.size(); ++i) {
    const PlyProperty& property = element.properties[i];
    Column column{property.type, property.count_type, property.is_list, -1, stride_};
    if (property.is_list) {
      has_list_ = true;
      if (static_cast<int>(i) == list) column.slot = 0;
    } else {
      stride_ += ScalarSize(property.type);
      for (size_t slot = 0; slot < scalars.size(); ++slot) {
        if (scalars[slot] == static_cast<int>(i)) column.slot = static_cast<int>(slot);
      }
      if (column.slot >= 0) wanted_.push_back(column);
    }
    columns_.push_back(column);
  }
}

absl::Status PlyElementReader::Truncated() const {
  return absl::DataLossError(
      absl::StrCat("PLY element ", Quoted(element_.name), ": the header claims ", element_.count,
                   ", the bytes end in number ", instance_ + 1, "; truncated file or wrong count"));
}

absl::Status PlyElementReader::Error(size_t column, absl::string_view what) const {
  std::string where =
      absl::StrCat("PLY element ", Quoted(element_.name), ", number ", instance_ + 1);
  if (ascii_) absl::StrAppend(&where, ", line ", source_->line_number());
  if (column < element_.properties.size()) {
    absl::StrAppend(&where, ", property ", Quoted(element_.properties[column].name));
  }
  return absl::InvalidArgumentError(absl::StrCat(where, ": ", what));
}

absl::Status PlyElementReader::Next() {
  if (columns_.empty()) return absl::OkStatus();
  RILIEVO_RETURN_IF_ERROR(ascii_ ? NextAscii() : has_list_ ? NextWithLists() : NextFixed());
  ++instance_;
  return absl::OkStatus();
}

absl::Status PlyElementReader::NextAscii() {
  std::string_view line, word;
  std::string_view rest;
  do {
    const ByteSource::Line result = source_->NextLine(&line);
    if (result == ByteSource::Line::kEnd) return Truncated();
    if (result == ByteSource::Line::kTooLong) return Error(columns_.size(), "a line over 1 MiB");
    rest = line;
    word = NextWord(&rest);
  } while (word.empty());
  for (size_t i = 0; i < columns_.size(); ++i) {
    const Column& column = columns_[i];
    uint64_t items = 1;
    if (column.is_list) {
      if (!ParseCount(word, &items)) {
        return Error(i, absl::StrCat("the list count ", Quoted(word), " is not a whole number"));
      }
      if (column.slot == 0) list_.clear();
      word = NextWord(&rest);
    }
    for (uint64_t item = 0; item < items; ++item) {
      if (word.empty()) {
        if (!source_->line_was_ended()) return Truncated();
        return Error(i, "the line has too few values");
      }
      if (column.slot >= 0) {
        double value = 0;
        if (const absl::Status status = ParseNumber(word, &value); !status.ok()) {
          return Error(i, status.message());
        }
        if (column.is_list) {
          list_.push_back(value);
        } else {
          values_[static_cast<size_t>(column.slot)] = value;
        }
      }
      word = NextWord(&rest);
    }
  }
  if (word.empty()) return absl::OkStatus();
  return Error(columns_.size(), absl::StrCat("the line has more values than the element has ",
                                             "properties, from ", Quoted(word), " on"));
}

absl::Status PlyElementReader::NextFixed() {
  if (rows_left_ == 0) {
    const uint64_t block =
        std::clamp<uint64_t>(kRowBlockBytes / stride_, 1, element_.count - instance_);
    rows_ = source_->Take(block * stride_);
    rows_left_ = block;
    if (rows_ == nullptr) return Truncated();
  }
  for (const Column& column : wanted_) {
    values_[static_cast<size_t>(column.slot)] =
        LoadScalar(rows_ + column.offset, column.type, swap_);
  }
  rows_ += stride_;
  --rows_left_;
  return absl::OkStatus();
}

absl::Status PlyElementReader::NextWithLists() {
  for (size_t i = 0; i < columns_.size(); ++i) {
    const Column& column = columns_[i];
    if (column.is_list) {
      RILIEVO_RETURN_IF_ERROR(ReadList(column, i));
      continue;
    }
    const char* bytes = source_->Take(ScalarSize(column.type));
    if (bytes == nullptr) return Truncated();
    if (column.slot >= 0) {
      values_[static_cast<size_t>(column.slot)] = LoadScalar(bytes, column.type, swap_);
    }
  }
  return absl::OkStatus();
}

absl::Status PlyElementReader::ReadList(const Column& column, size_t index) {
  const char* bytes = source_->Take(ScalarSize(column.count_type));
  if (bytes == nullptr) return Truncated();
  const double claimed = LoadScalar(bytes, column.count_type, swap_);
  uint64_t count = 0;
  if (!CountFromScalar(claimed, &count)) {
    return Error(index, absl::StrCat("the list claims ", claimed, " items"));
  }
  const size_t size = ScalarSize(column.type);
  if (count > (uint64_t{1} << 60) || !source_->MayHold(count * size)) {
    return Error(index, absl::StrCat("the list claims ", count, " items, more than the bytes left ",
                                     "hold; truncated or damaged file"));
  }
  if (column.slot < 0) return source_->Skip(count * size) ? absl::OkStatus() : Truncated();
  list_.clear();
  while (count > 0) {
    const uint64_t block = std::min<uint64_t>(count, kRowBlockBytes / size);
    const char* items = source_->Take(block * size);
    if (items == nullptr) return Truncated();
    for (uint64_t i = 0; i < block; ++i) {
      list_.push_back(LoadScalar(items + i * size, column.type, swap_));
    }
    count -= block;
  }
  return absl::OkStatus();
}

absl::Status SkipPlyElement(ByteSource* source, const PlyHeader& header,
                            const PlyElement& element) {
  if (element.properties.empty()) return absl::OkStatus();
  RILIEVO_RETURN_IF_ERROR(CheckElementFits(element, header.ascii(), *source));
  PlyElementReader reader(source, header, element, {}, -1);
  for (uint64_t i = 0; i < element.count; ++i) RILIEVO_RETURN_IF_ERROR(reader.Next());
  return absl::OkStatus();
}

}  // namespace rilievo

// Values as bytes and back, for files that the same program reads again on the same machine.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

namespace rilievo {

// Both are called for each value in turn: a function over a value's fields, template of which of
// the two, is all it takes.
class ValueWriter {
 public:
  template <typename Value>
  void operator()(const Value& value) {
    static_assert(std::is_trivially_copyable_v<Value>);
    Append(&value, sizeof(value));
  }
  template <typename Item>
  void operator()(const std::vector<Item>& items) {
    static_assert(std::is_trivially_copyable_v<Item>);
    (*this)(static_cast<int64_t>(items.size()));
    Append(items.data(), items.size() * sizeof(Item));
  }
  void operator()(const std::vector<std::vector<uint8_t>>& pieces) {
    (*this)(static_cast<int64_t>(pieces.size()));
    for (const std::vector<uint8_t>& piece : pieces) (*this)(piece);
  }
  void operator()(const std::string& text) {
    (*this)(static_cast<int64_t>(text.size()));
    Append(text.data(), text.size());
  }
  template <typename Scalar, int Columns>
  void operator()(const Eigen::Matrix<Scalar, 3, Columns>& columns) {
    (*this)(int64_t{columns.cols()});
    Append(columns.data(), static_cast<size_t>(columns.size()) * sizeof(Scalar));
  }

  std::vector<uint8_t> bytes;

 private:
  void Append(const void* data, size_t count) {
    if (count == 0) return;
    const size_t at = bytes.size();
    bytes.resize(at + count);
    std::memcpy(bytes.data() + at, data, count);
  }
};

// No count is believed that the bytes have no room for. Once they end too early, everything else
// stays as it is.
class ValueReader {
 public:
  explicit ValueReader(std::span<const uint8_t> bytes) : bytes_(bytes) {}

  template <typename Value>
  void operator()(Value& value) {
    static_assert(std::is_trivially_copyable_v<Value>);
    Take(&value, sizeof(value));
  }
  template <typename Item>
  void operator()(std::vector<Item>& items) {
    items.resize(CountOf(sizeof(Item)));
    Take(items.data(), items.size() * sizeof(Item));
  }
  void operator()(bool& value) {
    uint8_t byte = 0;
    (*this)(byte);
    if (byte > 1) whole_ = false;
    if (whole_) value = byte == 1;
  }
  void operator()(std::vector<std::vector<uint8_t>>& pieces) {
    pieces.resize(CountOf(sizeof(int64_t)));
    for (std::vector<uint8_t>& piece : pieces) (*this)(piece);
  }
  void operator()(std::string& text) {
    text.resize(CountOf(1));
    Take(text.data(), text.size());
  }
  template <typename Scalar, int Columns>
  void operator()(Eigen::Matrix<Scalar, 3, Columns>& columns) {
    const size_t count = CountOf(3 * sizeof(Scalar));
    if (Columns != Eigen::Dynamic && count != static_cast<size_t>(Columns)) whole_ = false;
    if (!whole_) return;
    columns.resize(3, static_cast<Eigen::Index>(count));
    Take(columns.data(), 3 * count * sizeof(Scalar));
  }

  // All bytes were asked for, and all that was asked for was there.
  bool Finished() const { return whole_ && bytes_.empty(); }

 private:
  size_t CountOf(size_t item_bytes) {
    int64_t count = 0;
    (*this)(count);
    if (count < 0 || static_cast<uint64_t>(count) > bytes_.size() / item_bytes) whole_ = false;
    return whole_ ? static_cast<size_t>(count) : 0;
  }
  void Take(void* data, size_t count) {
    if (count > bytes_.size()) whole_ = false;
    if (!whole_ || count == 0) return;
    std::memcpy(data, bytes_.data(), count);
    bytes_ = bytes_.subspan(count);
  }

  std::span<const uint8_t> bytes_;
  bool whole_ = true;
};

}  // namespace rilievo

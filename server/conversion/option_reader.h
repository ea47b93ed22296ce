// Optional fields of the protocol, read into the core's options and checked on the way.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "server/conversion/call_error.h"

namespace rilievo {

// An interval, as the comments of the proto write it.
struct Range {
  double low = 0, high = 0;
  bool low_open = false, high_open = false;

  bool Contains(double value) const;  // false for NaN
  std::string Text() const;           // "(0, 0.5]"
};

// Collects what is out of range; a field that is left out keeps the target's default.
class OptionReader {
 public:
  // `path`: of the message whose fields are read, without a dot at the end.
  OptionReader(std::string path, std::vector<FieldViolation>* violations);

  template <typename Value, typename Target>
  void Read(const char* field, bool present, Value value, const Range& range, Target* target) {
    if (!present) return;
    if (range.Contains(static_cast<double>(value))) {
      Assign(value, target);
    } else {
      Violate(field, static_cast<double>(value), range);
    }
  }

  void Violate(const char* field, const std::string& description);

 private:
  void Violate(const char* field, double value, const Range& range);

  template <typename Value, typename Target>
  static void Assign(Value value, Target* target) {
    *target = static_cast<Target>(value);
  }
  template <typename Value, typename Target>
  static void Assign(Value value, std::optional<Target>* target) {
    *target = static_cast<Target>(value);
  }

  std::string path_;
  std::vector<FieldViolation>* violations_;
};

}  // namespace rilievo

#include "server/conversion/option_reader.h"

#include <utility>

#include "absl/strings/str_cat.h"

namespace rilievo {

bool Range::Contains(double value) const {
  return (low_open ? value > low : value >= low) && (high_open ? value < high : value <= high);
}

std::string Range::Text() const {
  return absl::StrCat(low_open ? "(" : "[", low, ", ", high, high_open ? ")" : "]");
}

OptionReader::OptionReader(std::string path, std::vector<FieldViolation>* violations)
    : path_(std::move(path)), violations_(violations) {}

void OptionReader::Violate(const char* field, const std::string& description) {
  violations_->push_back({absl::StrCat(path_, ".", field), description});
}

void OptionReader::Violate(const char* field, double value, const Range& range) {
  Violate(field, absl::StrCat(value, " is outside ", range.Text(),
                              "; give a value in that range, or leave it out for the default"));
}

}  // namespace rilievo

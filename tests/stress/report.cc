#include "tests/stress/report.h"

#include <algorithm>
#include <cstdio>
#include <utility>

#include "nlohmann/json.hpp"

namespace rilievo::stress {
namespace {

const char* WordOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kPass:
      return "pass";
    case Verdict::kFail:
      return "FAIL";
    case Verdict::kNotLookedAt:
      return "not looked at";
  }
  return "";
}

}  // namespace

void Report::Expect(const std::string& part, const std::string& asked, bool met,
                    const std::string& seen) {
  Add({part, asked, seen, met ? Verdict::kPass : Verdict::kFail});
}

void Report::NotLookedAt(const std::string& part, const std::string& asked,
                         const std::string& reason) {
  Add({part, asked, reason, Verdict::kNotLookedAt});
}

void Report::Add(Row row) {
  const std::lock_guard lock(mutex_);
  std::fprintf(stderr, "%-13s  %s: %s -- %s\n", WordOf(row.verdict), row.part.c_str(),
               row.asked.c_str(), row.seen.c_str());
  rows_.push_back(std::move(row));
}

bool Report::Passed() const {
  const std::lock_guard lock(mutex_);
  return !rows_.empty() && std::none_of(rows_.begin(), rows_.end(), [](const Row& row) {
    return row.verdict == Verdict::kFail;
  });
}

std::string Report::Table() const {
  const std::lock_guard lock(mutex_);
  std::string table = "| part | asked | seen | verdict |\n| --- | --- | --- | --- |\n";
  for (const Row& row : rows_) {
    absl::StrAppendFormat(&table, "| %s | %s | %s | %s |\n", row.part, row.asked, row.seen,
                          WordOf(row.verdict));
  }
  return table;
}

std::string Report::Json() const {
  const std::lock_guard lock(mutex_);
  nlohmann::json rows = nlohmann::json::array();
  for (const Row& row : rows_) {
    rows.push_back({{"part", row.part},
                    {"asked", row.asked},
                    {"seen", row.seen},
                    {"verdict", WordOf(row.verdict)}});
  }
  return rows.dump(2);
}

}  // namespace rilievo::stress

// What was asked of the server, what was seen, and whether that is enough.
#pragma once

#include <mutex>
#include <string>
#include <vector>

#include "absl/strings/str_format.h"

namespace rilievo::stress {

enum class Verdict { kPass, kFail, kNotLookedAt };

struct Row {
  std::string part;   // of the program, such as "clients"
  std::string asked;  // in words, with the bound
  std::string seen;   // the figures
  Verdict verdict = Verdict::kFail;
};

// Rows are printed as they come. Thread-safe.
class Report {
 public:
  void Expect(const std::string& part, const std::string& asked, bool met, const std::string& seen);

  // Where this machine cannot show it, for the reason given.
  void NotLookedAt(const std::string& part, const std::string& asked, const std::string& reason);

  bool Passed() const;
  std::string Table() const;
  std::string Json() const;

 private:
  void Add(Row row);

  mutable std::mutex mutex_;
  std::vector<Row> rows_;
};

}  // namespace rilievo::stress

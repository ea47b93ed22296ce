// The jobs that a server has acknowledged, and whether it kept its word.
#pragma once

#include <map>
#include <mutex>
#include <string>

#include "tests/stress/stress_server.h"

namespace rilievo::stress {

// What became of the jobs.
struct Audit {
  int jobs = 0;       // acknowledged
  int succeeded = 0;  // with the right bytes
  int cancelled = 0;  // of those that a client cancelled
  int wrong = 0;      // lost, failed, unfinished, or with other bytes
  int extra = 0;      // listed by the server, acknowledged to nobody
  int attempts = 0;   // together
  std::string first_fault;

  bool clean() const { return jobs > 0 && wrong == 0 && extra == 0; }
  std::string Words() const;
};

// Thread-safe.
class Ledger {
 public:
  // `scan`: its place among KnownScans().
  void Acknowledged(const std::string& job_id, size_t scan);
  // The client asked for its end: it may be either cancelled or done.
  void Cancelled(const std::string& job_id);

  // Waits for the end of every job, and fetches and compares every surface.
  Audit Check(const StressServer& server) const;

 private:
  struct Entry {
    size_t scan = 0;
    bool cancelled = false;
  };

  mutable std::mutex mutex_;
  std::map<std::string, Entry> entries_;
};

}  // namespace rilievo::stress

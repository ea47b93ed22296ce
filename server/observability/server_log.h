// The log of this process: one line an event, on standard error.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdint>
#include <string>

#include "server/observability/event_line.h"
#include "server/observability/job_log.h"
#include "server/observability/line_writer.h"

namespace rilievo {

// Thread-safe, and never waits for who reads.
class ServerLog {
 public:
  enum class Format { kJson, kText };

  ServerLog(int file, Format format) : writer_(file), format_(format) {}

  void Event(const std::string& event, const EventFields& fields);
  void Job(const JobRecord& record);

  // Whether all lines so far were written in time.
  bool Flush(std::chrono::milliseconds timeout) { return writer_.Flush(timeout); }

  // Lines that were left out since nobody read.
  uint64_t dropped() const { return writer_.dropped(); }

  // From here on LogEvent() of any thread, and what gRPC and protobuf have to say, go to `log`,
  // which lives as long as this process. Once.
  static void Use(ServerLog* log);

 private:
  void Put(std::string line);

  LineWriter writer_;
  const Format format_;
  std::atomic<uint64_t> told_ = 0;  // dropped lines, of which a line tells
};

// One line in the log of this process; before there is one, on standard error.
void LogEvent(const std::string& event, const EventFields& fields);

// Event "server", field "message".
void LogMessage(const std::string& message);

// Of the log of this process.
uint64_t DroppedLogLines();

// Waits for what was logged so far, as before the process ends.
void FlushLog(std::chrono::milliseconds timeout);

}  // namespace rilievo

#include "server/observability/server_log.h"

#include <cstdio>
#include <utility>

#include "absl/strings/str_cat.h"
#include "server/observability/library_log.h"

namespace rilievo {
namespace {

// gRPC and protobuf take functions without an object, and have one for the process.
std::atomic<ServerLog*> log_of_process = nullptr;

}  // namespace

void ServerLog::Event(const std::string& event, const EventFields& fields) {
  const std::string time = TimeOfLine();
  Put(format_ == Format::kJson ? EventJson(time, event, fields) : EventText(time, event, fields));
}

void ServerLog::Job(const JobRecord& record) {
  const std::string time = TimeOfLine();
  Put(format_ == Format::kJson ? JobJson(record, time) : absl::StrCat(time, " ", JobLine(record)));
}

void ServerLog::Put(std::string line) {
  if (!writer_.Write(std::move(line))) return;
  const uint64_t dropped = writer_.dropped();
  if (const uint64_t told = told_.exchange(dropped); told < dropped) {
    Event("log",
          {{"message", absl::StrCat(dropped - told, " lines were dropped: nobody read this log")}});
  }
}

void ServerLog::Use(ServerLog* log) {
  log_of_process = log;
  CatchLibraryLogs();
}

void LogEvent(const std::string& event, const EventFields& fields) {
  if (ServerLog* log = log_of_process) {
    log->Event(event, fields);
  } else {
    std::fprintf(stderr, "%s\n", EventText(TimeOfLine(), event, fields).c_str());
  }
}

void LogMessage(const std::string& message) { LogEvent("server", {{"message", message}}); }

uint64_t DroppedLogLines() {
  const ServerLog* log = log_of_process;
  return log == nullptr ? 0 : log->dropped();
}

void FlushLog(std::chrono::milliseconds timeout) {
  if (ServerLog* log = log_of_process) log->Flush(timeout);
}

}  // namespace rilievo

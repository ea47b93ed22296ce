#include "server/observability/library_log.h"

#include <chrono>
#include <cstdlib>
#include <optional>
#include <string>

#include "absl/strings/match.h"
#include "google/protobuf/stubs/logging.h"
#include "grpc/support/log.h"
#include "server/observability/line_rate.h"
#include "server/observability/server_log.h"

namespace rilievo {
namespace {

constexpr std::chrono::milliseconds kLastWords{500};

bool AllAreWanted() {
  return std::getenv("GRPC_VERBOSITY") != nullptr || std::getenv("GRPC_TRACE") != nullptr;
}

void LogOfLibrary(const char* library, const char* severity, const std::string& message) {
  static LineRate rate(kLibraryLinesPerSecond);
  static const bool all = AllAreWanted();
  const std::optional<uint64_t> left_out = all ? 0 : rate.Pass(LineRate::Clock::now());
  if (!left_out) return;
  EventFields fields = {{"library", library}, {"severity", severity}, {"message", message}};
  if (*left_out > 0) fields.emplace_back("left_out", std::to_string(*left_out));
  LogEvent("library", fields);
}

void LogOfGrpc(gpr_log_func_args* line) {
  static constexpr const char* kNames[] = {"DEBUG", "INFO", "ERROR"};
  LogOfLibrary("grpc", kNames[line->severity], line->message);
  // The next thing that gRPC does is to abort this process.
  if (absl::StartsWith(line->message, "assertion failed")) FlushLog(kLastWords);
}

void LogOfProtobuf(google::protobuf::LogLevel level, const char* /*file*/, int /*line*/,
                   const std::string& message) {
  static constexpr const char* kNames[] = {"INFO", "WARNING", "ERROR", "FATAL"};
  LogOfLibrary("protobuf", kNames[level], message);
  if (level == google::protobuf::LOGLEVEL_FATAL) FlushLog(kLastWords);
}

}  // namespace

void CatchLibraryLogs() {
  gpr_set_log_function(LogOfGrpc);
  google::protobuf::SetLogHandler(LogOfProtobuf);
}

}  // namespace rilievo

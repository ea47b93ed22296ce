// What gRPC and protobuf print, as lines of the server's own log.
#pragma once

namespace rilievo {

// Some of their lines hold a caller's words, and any caller can cause one. From here on each is an
// event "library" of LogEvent(): library, severity, message, and left_out, the number of lines
// before it beyond kLibraryLinesPerSecond. All of them when the environment asks gRPC for more than
// errors (GRPC_VERBOSITY, GRPC_TRACE).
void CatchLibraryLogs();

inline constexpr int kLibraryLinesPerSecond = 5;

}  // namespace rilievo

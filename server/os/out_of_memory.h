// What this process does when the system refuses it memory.
#pragma once

#include <chrono>

namespace rilievo {

// From here on an allocation of C++ that finds no memory is tried again for kMemoryPatience, while
// what this process holds without need goes back to the system. After that the process ends, with
// exit code 1 and a line on standard error. No std::bad_alloc is thrown: protobuf's and gRPC's own
// state does not survive one, and gRPC takes it for the end of a call and goes on with what is
// half made. Where a library in C ends the process by abort(), as gRPC does without memory, a line
// says so too.
void EndWithoutMemory();

inline constexpr std::chrono::milliseconds kMemoryPatience{200};

}  // namespace rilievo

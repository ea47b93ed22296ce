// What this process takes of the machine.
#pragma once

#include <chrono>
#include <cstdint>

namespace rilievo {

// Resident memory, bytes.
int64_t ResidentBytes();

// Processor time of all threads so far.
std::chrono::nanoseconds ProcessorTime();

}  // namespace rilievo

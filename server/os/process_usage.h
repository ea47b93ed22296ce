// What this process takes of the machine.
#pragma once

#include <chrono>
#include <cstdint>

namespace rilievo {

// Resident memory, bytes.
int64_t ResidentBytes();

// Processor time so far, of all threads and of the one that asks.
std::chrono::nanoseconds ProcessorTime();
std::chrono::nanoseconds ProcessorTimeOfThread();

}  // namespace rilievo

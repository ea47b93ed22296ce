// How the job of a moody worker goes: the seed of its request.
#pragma once

namespace rilievo {

enum class Mood {
  kWell = 0,  // chunks of 10, 0, 3 000 000 and 0 bytes; its limits as road_reason
  kRefuse,    // FAILED_PRECONDITION "not planar"
  kCrash,     // SIGSEGV
  kKilled,    // SIGKILL
  kExit,      // ends without a word
  kThrow,     // an exception on a thread of its own
  kHungry,    // a terabyte, on a thread of its own
  kModest,    // 64 MiB, then well
  kSpin,      // uses its processor time for ever
  kSleep,     // for ever, whatever it is asked
  kWriting,   // into its files; what it could, as road_reason
  // What it reached of all that a worker has no need of, as road_reason.
  kCompromised,
  kManyChunks,   // announces a million
  kLargeChunk,   // announces more than 2^64 bytes in all
  kForeignCode,  // a failure that no job has
};

}  // namespace rilievo

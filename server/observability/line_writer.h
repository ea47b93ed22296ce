// Lines to a reader who may have stopped reading.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

namespace rilievo {

// A thread of its own writes; those who have a line to write never wait for it. Thread-safe.
class LineWriter {
 public:
  static constexpr size_t kMostBytes = 1 << 20;

  // To a duplicate of `file`: its number may belong to another file by the time that a stuck thread
  // goes on. Lines beyond `most_bytes` that wait are dropped. Throws std::system_error.
  explicit LineWriter(int file, size_t most_bytes = kMostBytes);

  // Gives the reader kLastTime for what still waits.
  ~LineWriter();
  static constexpr std::chrono::seconds kLastTime{1};

  LineWriter(const LineWriter&) = delete;
  LineWriter& operator=(const LineWriter&) = delete;

  // `line` without its end. False when it was dropped.
  bool Write(std::string line);

  // Whether all lines so far were written in time.
  bool Flush(std::chrono::milliseconds timeout);

  // Lines so far that nobody will read.
  uint64_t dropped() const;

 private:
  struct State;

  const std::shared_ptr<State> state_;  // its thread may be stuck in a write, and outlive this
};

}  // namespace rilievo

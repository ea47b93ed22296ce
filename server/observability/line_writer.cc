#include "server/observability/line_writer.h"

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <climits>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <system_error>
#include <thread>
#include <utility>

#include "server/os/file_descriptor.h"

namespace rilievo {
namespace {

constexpr int kLookAgainMilliseconds = 100;

}  // namespace

struct LineWriter::State {
  FileDescriptor file;
  size_t most_bytes;
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<std::string> lines;
  size_t bytes = 0;      // of `lines`
  bool writing = false;  // what is no longer in `lines`
  bool closing = false;
  std::atomic<bool> abandoned = false;
  std::atomic<uint64_t> dropped = 0;

  void Run();
  std::pair<std::string, uint64_t> TakeLines();
  bool WriteAll(const std::string& text) const;
};

// As many whole lines as a pipe takes at once, or one long line; and how many.
std::pair<std::string, uint64_t> LineWriter::State::TakeLines() {
  std::string text;
  uint64_t count = 0;
  while (!lines.empty() && (text.empty() || text.size() + lines.front().size() <= PIPE_BUF)) {
    text += lines.front();
    bytes -= lines.front().size();
    lines.pop_front();
    ++count;
  }
  return {std::move(text), count};
}

// Pieces of PIPE_BUF: a pipe that poll() says is ready takes so many without waiting. The flag
// O_NONBLOCK would be that of whoever shares the file, such as the shell.
bool LineWriter::State::WriteAll(const std::string& text) const {
  for (size_t at = 0; at < text.size();) {
    pollfd ready{file.number(), POLLOUT, 0};
    const int found = poll(&ready, 1, kLookAgainMilliseconds);
    if (abandoned) return false;
    if (found <= 0) continue;
    const ssize_t written =
        write(file.number(), text.data() + at, std::min<size_t>(text.size() - at, PIPE_BUF));
    if (written > 0) {
      at += static_cast<size_t>(written);
    } else if (errno == EAGAIN) {
      if (abandoned) return false;
      poll(nullptr, 0, kLookAgainMilliseconds);
    } else if (errno != EINTR) {
      return false;  // nobody reads any more, or the disk is full
    }
  }
  return true;
}

void LineWriter::State::Run() {
  std::unique_lock lock(mutex);
  for (;;) {
    changed.wait(lock, [this] { return closing || !lines.empty(); });
    if (lines.empty() || abandoned) return;
    const auto [text, count] = TakeLines();
    writing = true;
    lock.unlock();
    const bool written = WriteAll(text);
    lock.lock();
    if (!written) dropped += count;
    writing = false;
    changed.notify_all();
  }
}

LineWriter::LineWriter(int file, size_t most_bytes) : state_(std::make_shared<State>()) {
  state_->file = FileDescriptor(fcntl(file, F_DUPFD_CLOEXEC, 0));
  if (!state_->file.valid()) throw std::system_error(errno, std::generic_category(), "log");
  state_->most_bytes = most_bytes;
  std::thread([state = state_] { state->Run(); }).detach();
}

LineWriter::~LineWriter() {
  Flush(kLastTime);
  const std::lock_guard lock(state_->mutex);
  state_->closing = true;
  state_->abandoned = true;
  state_->changed.notify_all();
}

bool LineWriter::Write(std::string line) {
  line += '\n';
  const std::lock_guard lock(state_->mutex);
  if (state_->bytes + line.size() > state_->most_bytes) {
    ++state_->dropped;
    return false;
  }
  state_->bytes += line.size();
  state_->lines.push_back(std::move(line));
  state_->changed.notify_all();
  return true;
}

bool LineWriter::Flush(std::chrono::milliseconds timeout) {
  std::unique_lock lock(state_->mutex);
  return state_->changed.wait_for(lock, timeout,
                                  [&] { return state_->lines.empty() && !state_->writing; });
}

uint64_t LineWriter::dropped() const { return state_->dropped; }

}  // namespace rilievo

// The parts that a worker process shares with others, as its server tells of them.
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>

#include "core/paging/shared_parts.h"
#include "server/os/file_descriptor.h"
#include "server/worker/worker_protocol.pb.h"

namespace rilievo {

// INTERNAL where the server says what was not asked, or is gone.
class SocketParts final : public SharedParts {
 public:
  // `socket` outlives it.
  SocketParts(const FileDescriptor* socket, bool leads) : socket_(socket), leads_(leads) {}

  bool leads() const override { return leads_; }
  absl::StatusOr<Turn> Next(PartStep step, int count) override;
  absl::Status Keep(PartStep step, int part, const PieceSource& next) override;
  absl::Status Fetch(PartStep step, int part, const PieceSink& take) override;

  // What came from the server, on the thread that reads. Waits until the one before was used.
  void Take(worker::ServerMessage message);

 private:
  worker::ServerMessage Received();

  const FileDescriptor* const socket_;
  const bool leads_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::optional<worker::ServerMessage> received_;
};

}  // namespace rilievo

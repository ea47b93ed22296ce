#include "server/worker/socket_parts.h"

#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>

#include "core/base/status_macros.h"
#include "server/worker/message_channel.h"

namespace rilievo {
namespace {

absl::Status NotAsked() { return absl::InternalError("the server said what was not asked"); }

worker::PartOfStep Numbers(PartStep step, int part) {
  worker::PartOfStep numbers;
  numbers.set_step(static_cast<int>(step));
  numbers.set_part(part);
  return numbers;
}

}  // namespace

void SocketParts::Take(worker::ServerMessage message) {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return !received_; });
  received_ = std::move(message);
  changed_.notify_all();
}

worker::ServerMessage SocketParts::Received() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return received_.has_value(); });
  worker::ServerMessage message = *std::move(received_);
  received_.reset();
  changed_.notify_all();
  return message;
}

absl::StatusOr<SharedParts::Turn> SocketParts::Next(PartStep step, int count) {
  worker::WorkerMessage message;
  *message.mutable_next_part() = Numbers(step, count);
  RILIEVO_RETURN_IF_ERROR(SendMessage(*socket_, message));
  const worker::ServerMessage answer = Received();
  if (!answer.has_turn() || answer.turn().part() >= count) return NotAsked();
  Turn turn{std::nullopt, answer.turn().done()};
  if (answer.turn().part() >= 0) turn.part = answer.turn().part();
  return turn;
}

absl::Status SocketParts::Keep(PartStep step, int part, const PieceSource& next) {
  worker::WorkerMessage message;
  *message.mutable_part_done() = Numbers(step, part);
  RILIEVO_RETURN_IF_ERROR(SendMessage(*socket_, message));
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const auto bytes, next());
    if (bytes.empty()) break;
    for (size_t at = 0; at < bytes.size(); at += kPieceBytes) {
      message.set_piece(bytes.data() + at, std::min(kPieceBytes, bytes.size() - at));
      RILIEVO_RETURN_IF_ERROR(SendMessage(*socket_, message));
    }
  }
  message.set_piece("");
  RILIEVO_RETURN_IF_ERROR(SendMessage(*socket_, message));
  return Received().kept() ? absl::OkStatus() : NotAsked();
}

absl::Status SocketParts::Fetch(PartStep step, int part, const PieceSink& take) {
  worker::WorkerMessage message;
  *message.mutable_fetch_part() = Numbers(step, part);
  RILIEVO_RETURN_IF_ERROR(SendMessage(*socket_, message));
  for (;;) {
    const worker::ServerMessage answer = Received();
    if (answer.message_case() != worker::ServerMessage::kPiece) return NotAsked();
    const std::string& piece = answer.piece();
    if (piece.empty()) return absl::OkStatus();
    RILIEVO_RETURN_IF_ERROR(take({reinterpret_cast<const uint8_t*>(piece.data()), piece.size()}));
  }
}

}  // namespace rilievo

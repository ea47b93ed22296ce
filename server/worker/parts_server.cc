#include "server/worker/parts_server.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <string>

#include "core/base/status_macros.h"
#include "server/conversion/parts_request.h"
#include "server/worker/message_channel.h"

namespace rilievo {
namespace {

// A scan of 10^12 points has as many of a thousand points.
constexpr int kMostPartsOfStep = 1 << 30;

// By points.
constexpr int64_t kFewParts = 1024, kFewPoints = 1024;

// Of what the job takes of a scratch folder, what may come of all of its parts; parts are done
// twice, or again after a worker was lost.
constexpr int64_t kShareOfScratch = 4, kSmallBytes = 64 << 20;

absl::Status NotAllowed(const char* what) { return absl::InternalError(what); }

std::span<const uint8_t> BytesOfPiece(const std::string& piece) {
  return {reinterpret_cast<const uint8_t*>(piece.data()), piece.size()};
}

}  // namespace

bool PartsServer::IsAsked(const worker::WorkerMessage& message) const {
  return job_.parts && job_.parts->shared &&
         (message.has_next_part() || message.has_part_done() || message.has_fetch_part());
}

absl::Status PartsServer::Send(const worker::ServerMessage& message) {
  const absl::Status sent = SendMessage(socket_, message);
  worker_is_gone_ = worker_is_gone_ || !sent.ok();
  return sent;
}

absl::Status PartsServer::Answer(const worker::WorkerMessage& asked) {
  const worker::PartOfStep& numbers = asked.has_next_part()   ? asked.next_part()
                                      : asked.has_part_done() ? asked.part_done()
                                                              : asked.fetch_part();
  if (numbers.step() < 0 || numbers.step() >= kMostPartSteps || numbers.part() < 0 ||
      numbers.part() > kMostPartsOfStep) {
    return NotAllowed("the worker asks for parts of a step that there is none of");
  }
  const auto step = static_cast<PartStep>(numbers.step());
  if (asked.has_next_part()) return TellTurn(step, numbers.part());
  return asked.has_part_done() ? TakePart(step, numbers.part()) : SendPart(step, numbers.part());
}

int64_t PartsServer::MostPartsOf(PartStep step) const {
  if (IsOnePart(step)) return 1;
  const int64_t by_points = kFewParts + job_.size.points / kFewPoints;
  if (step < PartStep::kMeasured) return by_points;
  // Of blocks of the finest level: groups of faces that are at least half full.
  const int64_t block = std::max<int64_t>(1, PartSizes::Of(job_.parts->points).block_vertices);
  const int64_t by_faces = 2 * (job_.options.max_surface_faces / block);
  return by_faces + (step == PartStep::kMeasured ? by_points : kFewParts);
}

absl::Status PartsServer::TellTurn(PartStep step, int count) {
  if (count > MostPartsOf(step)) {
    return NotAllowed("the worker cuts a step into more parts than it has");
  }
  RILIEVO_ASSIGN_OR_RETURN(const SharedParts::Turn turn, job_.parts->shared->Next(step, count));
  given_ = {step, turn.part.value_or(-1)};
  worker::ServerMessage message;
  message.mutable_turn()->set_part(turn.part.value_or(-1));
  message.mutable_turn()->set_done(turn.done);
  return Send(message);
}

absl::Status PartsServer::TakePart(PartStep step, int part) {
  if (given_ != std::pair(step, part)) return NotAllowed("the worker has done another part");
  given_.second = -1;
  const int64_t most = kShareOfScratch * EstimateScratch(job_) + kSmallBytes;
  worker::WorkerMessage message;
  const auto next = [&]() -> absl::StatusOr<std::span<const uint8_t>> {
    const absl::Status received = ReceiveMessage(socket_, &message);
    worker_is_gone_ = worker_is_gone_ || !received.ok();
    RILIEVO_RETURN_IF_ERROR(received);
    if (message.message_case() != worker::WorkerMessage::kPiece) {
      return NotAllowed("the worker sends no piece of its part");
    }
    taken_bytes_ += static_cast<int64_t>(message.piece().size());
    if (taken_bytes_ > most) return NotAllowed("the worker sends more than its job may");
    return BytesOfPiece(message.piece());
  };
  RILIEVO_RETURN_IF_ERROR(job_.parts->shared->Keep(step, part, next));
  worker::ServerMessage kept;
  kept.set_kept(true);
  return Send(kept);
}

absl::Status PartsServer::SendPart(PartStep step, int part) {
  worker::ServerMessage message;
  const auto send = [&](std::span<const uint8_t> piece) -> absl::Status {
    for (size_t at = 0; at < piece.size(); at += kPieceBytes) {
      message.set_piece(piece.data() + at, std::min(kPieceBytes, piece.size() - at));
      RILIEVO_RETURN_IF_ERROR(Send(message));
    }
    return absl::OkStatus();
  };
  RILIEVO_RETURN_IF_ERROR(job_.parts->shared->Fetch(step, part, send));
  message.set_piece("");
  return Send(message);
}

}  // namespace rilievo

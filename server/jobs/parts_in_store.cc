#include "server/jobs/parts_in_store.h"

#include <algorithm>
#include <chrono>
#include <thread>

#include "absl/strings/str_cat.h"
#include "core/base/sha256.h"
#include "core/base/status_macros.h"
#include "core/paging/parts_recipe.h"
#include "server/conversion/call_error.h"
#include "server/store/content_name.h"

namespace rilievo {
namespace {

// Between two looks whether others have done what is left, and while the store is away.
constexpr std::chrono::milliseconds kLook{100};
constexpr std::chrono::milliseconds kLookAtOnePart{1000};
// So long a job must be seen to wait before one who helps leaves: others may be about to take it.
constexpr std::chrono::milliseconds kWaiting{1000};
constexpr int64_t kBlockBytes = 1 << 20;

// What the store says, as an attempt at a job ends by it.
absl::Status OfAttempt(const absl::Status& status) {
  // DATA_LOSS would be said of the scan.
  if (absl::IsFailedPrecondition(status) || absl::IsDataLoss(status)) {
    return absl::AbortedError(status.message());
  }
  if (absl::IsResourceExhausted(status) && !StatedError(status)) {
    return absl::UnavailableError(status.message());
  }
  return status;
}

// The bytes to `take`; whether they have that SHA-256.
absl::StatusOr<bool> CopyBlob(const FileDescriptor& file, const std::string& sha256,
                              const PieceSink& take) {
  RILIEVO_ASSIGN_OR_RETURN(const int64_t size, file.Size());
  std::string block;
  Sha256 hash;
  for (int64_t at = 0; at < size; at += static_cast<int64_t>(block.size())) {
    block.resize(static_cast<size_t>(std::min(kBlockBytes, size - at)));
    RILIEVO_RETURN_IF_ERROR(file.ReadAt(at, block.data(), block.size()));
    AddBytes(block.data(), block.size(), &hash);
    RILIEVO_RETURN_IF_ERROR(take({reinterpret_cast<const uint8_t*>(block.data()), block.size()}));
  }
  return ContentName(hash) == sha256;
}

}  // namespace

PartsInStore::PartsInStore(JobStore* store, const StoredJob& job, const ServerOptions& options,
                           std::stop_token stop)
    : store_(store),
      worker_{.job_id = job.job.job_id(),
              .owner = job.owner,
              .worker = job.worker,
              .claim = job.claim,
              .memory = options.MemoryBudget(),
              .recipe = Recipe(options)},
      stop_(std::move(stop)) {}

std::string PartsInStore::Recipe(const ServerOptions& options) {
  return absl::StrCat(RILIEVO_VERSION, " ", kPartsRecipe, " ", options.max_surface_faces);
}

// Where that fails, its lease runs out.
PartsInStore::~PartsInStore() {
  if (claim_) store_->ReleaseParts(worker_.job_id, worker_.worker).IgnoreError();
}

absl::StatusOr<PartQueue::Turn> PartsInStore::TryNext(PartStep step, int count) {
  if (leads() && !begun_) RILIEVO_RETURN_IF_ERROR(store_->LeadParts(worker_));
  begun_ = true;
  return store_->TakePart(worker_, step, count);
}

absl::StatusOr<SharedParts::Turn> PartsInStore::Next(PartStep step, int count) {
  const auto look = !leads() && IsOnePart(step) ? kLookAtOnePart : kLook;
  std::chrono::milliseconds waits{0};
  while (!stop_.stop_requested()) {
    const auto turn = TryNext(step, count);
    if (turn.ok() && turn->was_wrong) {
      const char* const why = "what this worker has found of a part is wrong";
      return leads() ? absl::AbortedError(why) : absl::InternalError(why);
    }
    if (turn.ok() && (turn->claim || turn->done == count)) {
      claim_ = turn->claim;
      Turn next{std::nullopt, turn->done};
      if (claim_) next.part = claim_->part;
      return next;
    }
    if (!turn.ok() && !absl::IsUnavailable(turn.status())) return OfAttempt(turn.status());
    waits = turn.ok() && turn->job_waits ? waits + look : std::chrono::milliseconds(0);
    if (waits > kWaiting) return absl::AbortedError("a job waits for the place");
    std::this_thread::sleep_for(look);
  }
  return absl::CancelledError("nobody waits for the parts");
}

absl::Status PartsInStore::Keep(PartStep step, int part, const PieceSource& next) {
  if (!claim_ || claim_->step != step || claim_->part != part) {
    return absl::InternalError("a part that was not to be done");
  }
  const auto source = [&]() -> absl::StatusOr<std::string_view> {
    RILIEVO_ASSIGN_OR_RETURN(const auto piece, next());
    return std::string_view(reinterpret_cast<const char*>(piece.data()), piece.size());
  };
  RILIEVO_RETURN_IF_ERROR(OfAttempt(store_->KeepPart(*claim_, source)));
  claim_.reset();
  ++kept_;
  return absl::OkStatus();
}

absl::Status PartsInStore::Fetch(PartStep step, int part, const PieceSink& take) {
  std::string sha256;
  const auto file = store_->ReadPart(worker_.job_id, step, part, &sha256);
  bool whole = false;
  if (file.ok()) {
    const absl::StatusOr<bool> copied = CopyBlob(*file, sha256, take);
    if (absl::IsDataLoss(copied.status())) return OfAttempt(copied.status());
    RILIEVO_RETURN_IF_ERROR(copied.status());
    whole = *copied;
  } else if (!absl::IsNotFound(file.status())) {
    return OfAttempt(file.status());
  }
  if (whole) return absl::OkStatus();
  if (sha256.empty()) {
    return absl::AbortedError("the job ended, or a part that is not done was asked for");
  }
  store_->DropPart(worker_, step, part, sha256).IgnoreError();
  return absl::AbortedError("what came of a part is damaged; it is done again");
}

}  // namespace rilievo

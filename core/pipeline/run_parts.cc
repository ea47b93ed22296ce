#include "core/pipeline/run_parts.h"

#include <algorithm>
#include <mutex>
#include <thread>
#include <utility>

#include "absl/strings/str_cat.h"
#include "core/base/parallel_for_each.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

absl::Status RunAlone(const PartsOfStep& parts, const std::function<void(double)>& told,
                      const RunContext& context) {
  RunContext loop = context;
  loop.threads = std::clamp(context.ThreadCount(), 1, parts.at_once);
  RunContext own = context;
  own.progress = nullptr;  // others than the caller may not tell
  own.threads = parts.count == 1 ? context.ThreadCount()
                                 : (context.ThreadCount() + loop.threads - 1) / loop.threads;
  const std::thread::id caller = std::this_thread::get_id();
  std::mutex taking;
  absl::Status failed;
  int done = 0;
  const auto is_left = [&](int part) {
    const std::lock_guard lock(taking);
    if (!failed.ok()) return false;
    if (std::this_thread::get_id() == caller) told(static_cast<double>(done) / parts.count);
    if (!parts.is_there || !parts.is_there(part)) return true;
    ++done;
    return false;
  };
  const auto run = [&](int part) {
    if (!is_left(part)) return;
    const absl::StatusOr<std::vector<uint8_t>> bytes = parts.make(part, own);
    const std::lock_guard lock(taking);
    if (!failed.ok()) return;
    failed = bytes.ok() ? parts.take(part, *bytes) : bytes.status();
    ++done;
  };
  RILIEVO_RETURN_IF_ERROR(
      ParallelForEach(parts.count, 1, loop, [&](int64_t part) { run(static_cast<int>(part)); }));
  return failed;
}

absl::Status KeepIn(SharedParts* shared, PartStep step, int part,
                    const std::vector<uint8_t>& bytes) {
  std::span<const uint8_t> left(bytes);
  return shared->Keep(step, part, [&]() -> absl::StatusOr<std::span<const uint8_t>> {
    return std::exchange(left, {});
  });
}

absl::StatusOr<std::vector<uint8_t>> FetchFrom(SharedParts* shared, PartStep step, int part) {
  std::vector<uint8_t> bytes;
  RILIEVO_RETURN_IF_ERROR(shared->Fetch(step, part, [&](std::span<const uint8_t> piece) {
    bytes.insert(bytes.end(), piece.begin(), piece.end());
    return absl::OkStatus();
  }));
  return bytes;
}

}  // namespace

absl::Status RunParts(const PartsOfStep& parts, const PartsRun& run, const RunContext& context) {
  if (run.shared == nullptr) return RunAlone(parts, run.told, context);
  SharedParts& shared = *run.shared;
  const bool takes = shared.leads() || parts.step != PartStep::kMeasured;
  std::vector<bool> taken(static_cast<size_t>(parts.count), false);
  for (;;) {
    RILIEVO_ASSIGN_OR_RETURN(const SharedParts::Turn turn, shared.Next(parts.step, parts.count));
    run.told(static_cast<double>(turn.done) / parts.count);
    if (!turn.part) break;
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, parts.make(*turn.part, context));
    RILIEVO_RETURN_IF_ERROR(KeepIn(&shared, parts.step, *turn.part, bytes));
    if (!takes || taken[*turn.part]) continue;
    RILIEVO_RETURN_IF_ERROR(parts.take(*turn.part, bytes));
    taken[*turn.part] = true;
  }
  for (int part = 0; part < parts.count && takes; ++part) {
    if (taken[part]) continue;
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes,
                             FetchFrom(&shared, parts.step, part));
    RILIEVO_RETURN_IF_ERROR(parts.take(part, bytes));
  }
  return absl::OkStatus();
}

absl::Status NotOfPart(PartStep step, int part) {
  return absl::InternalError(absl::StrCat("part ", part, " of step ", static_cast<int>(step),
                                          " of the run is not what was kept of it"));
}

}  // namespace rilievo

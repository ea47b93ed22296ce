#include "core/pipeline/shared_coding.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "core/base/status_macros.h"
#include "core/codec/bytes/saved_value.h"
#include "core/pipeline/run_parts.h"
#include "core/pipeline/settings.h"

namespace rilievo {
namespace {

template <typename Archive, typename Error>
void VisitUncoded(Archive& archive, Error& uncoded) {
  archive(uncoded.spacing);
  archive(uncoded.noise);
  archive(uncoded.leverage);
  archive(uncoded.measured);
  archive(uncoded.error);
}

template <typename Archive, typename Coded>
void VisitCoded(Archive& archive, Coded& coded) {
  VisitUncoded(archive, coded.uncoded);
  archive(coded.encoded.chunks);
  archive(coded.encoded.height_step);
  archive(coded.encoded.height_rms);
  archive(coded.encoded.height_max);
}

// Lengths are fractions of the diagonal.
bool IsPossible(const UncodedError& uncoded) {
  const DistanceSummary& distance = uncoded.error.b_to_a;
  const double lengths[] = {uncoded.spacing, uncoded.noise, distance.rms, distance.p95};
  return uncoded.leverage > 0 && uncoded.leverage <= 1 && uncoded.error.across_rms <= 2 &&
         std::all_of(std::begin(lengths), std::end(lengths),
                     [](double length) { return length >= 0 && length <= 2; });
}

void TellNobody(double /*share*/) {}

}  // namespace

absl::Status ShareUncoded(const std::function<absl::Status()>& find, SharedParts* shared,
                          const RunContext& context, UncodedError* uncoded) {
  PartsOfStep step{.step = PartStep::kUncoded, .count = 1};
  step.make = [&](int /*part*/,
                  const RunContext& /*context*/) -> absl::StatusOr<std::vector<uint8_t>> {
    RILIEVO_RETURN_IF_ERROR(find());
    ValueWriter writer;
    VisitUncoded(writer, *uncoded);
    return std::move(writer.bytes);
  };
  step.take = [uncoded](int part, std::span<const uint8_t> bytes) {
    ValueReader reader(bytes);
    VisitUncoded(reader, *uncoded);
    return reader.Finished() && IsPossible(*uncoded) ? absl::OkStatus()
                                                     : NotOfPart(PartStep::kUncoded, part);
  };
  return RunParts(step, {TellNobody, shared}, context);
}

GatherBytes GatherByParts(SharedParts* shared) {
  return [shared, pass = 0](int count, const MakeBytes& make, const RunContext& context) mutable
         -> absl::StatusOr<std::vector<std::vector<uint8_t>>> {
    if (pass == kMostPasses) return absl::InternalError("coding takes too many passes");
    const int items =
        std::clamp(count / kSharedCoding.few_parts, 1, kSharedCoding.most_items_of_part);
    std::vector<std::vector<uint8_t>> all(static_cast<size_t>(count));
    PartsOfStep step{.step = PartStep{static_cast<int>(PartStep::kBlocks) + pass++},
                     .count = (count + items - 1) / items};
    const auto items_of = [count, items](int part) {
      return std::min(items, count - part * items);
    };
    step.make = [&](int part, const RunContext& own) -> absl::StatusOr<std::vector<uint8_t>> {
      const auto make_item = [&](int i, const RunContext& one_thread) {
        return make(part * items + i, one_thread);
      };
      RILIEVO_ASSIGN_OR_RETURN(const auto made, MakeSeveral(items_of(part), make_item, own));
      ValueWriter writer;
      writer(made);
      return std::move(writer.bytes);
    };
    step.take = [&](int part, std::span<const uint8_t> bytes) {
      std::vector<std::vector<uint8_t>> made;
      ValueReader reader(bytes);
      reader(made);
      if (!reader.Finished() || made.size() != static_cast<size_t>(items_of(part))) {
        return NotOfPart(step.step, part);
      }
      std::move(made.begin(), made.end(), all.begin() + std::ptrdiff_t{part} * items);
      return absl::OkStatus();
    };
    RILIEVO_RETURN_IF_ERROR(RunParts(step, {TellNobody, shared}, context));
    return all;
  };
}

std::vector<uint8_t> BytesOfCoded(const CodedStoredSurface& coded) {
  ValueWriter writer;
  VisitCoded(writer, coded);
  return std::move(writer.bytes);
}

bool ReadCoded(std::span<const uint8_t> bytes, CodedStoredSurface* coded) {
  ValueReader reader(bytes);
  VisitCoded(reader, *coded);
  return reader.Finished() && IsPossible(coded->uncoded);
}

}  // namespace rilievo

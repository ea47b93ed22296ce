#include "core/paging/scratch_surfels.h"

#include <cstring>
#include <span>
#include <type_traits>

#include "core/base/status_macros.h"
#include "core/codec/bytes/crc32c.h"

namespace rilievo {

static_assert(sizeof(Surfel) == 20 && std::is_trivially_copyable_v<Surfel>);

namespace {

// Of one surfel; those of many add up whatever their order.
uint64_t SumOf(int64_t rank, const Surfel& surfel) {
  const uint32_t checksum =
      Crc32c(std::span(reinterpret_cast<const uint8_t*>(&surfel), sizeof(surfel)));
  uint64_t mixed = (static_cast<uint64_t>(rank) << 32 ^ checksum) + 0x9e3779b97f4a7c15u;
  mixed = (mixed ^ (mixed >> 30)) * 0xbf58476d1ce4e5b9u;
  mixed = (mixed ^ (mixed >> 27)) * 0x94d049bb133111ebu;
  return mixed ^ (mixed >> 31);
}

}  // namespace

absl::StatusOr<ScratchSurfels> ScratchSurfels::Create(const PagedScan& scan) {
  RILIEVO_ASSIGN_OR_RETURN(
      ScratchBlocks blocks,
      ScratchBlocks::Create(scan.scratch_folder(), "surfels", static_cast<int>(scan.pages().size()),
                            kPagePoints * static_cast<int64_t>(sizeof(Surfel))));
  return ScratchSurfels(std::move(blocks), scan.size());
}

absl::StatusOr<uint64_t> ScratchSurfels::Write(const std::vector<int64_t>& ranks,
                                               const std::vector<Surfel>& surfels) {
  uint64_t sum = 0;
  size_t next = 0;
  while (next < ranks.size()) {
    const auto page = static_cast<int>(ranks[next] / kPagePoints);
    RILIEVO_ASSIGN_OR_RETURN(std::vector<Surfel> of_page, Read(page));
    for (; next < ranks.size() && ranks[next] / kPagePoints == page; ++next) {
      of_page[static_cast<size_t>(ranks[next] % kPagePoints)] = surfels[next];
      sum += SumOf(ranks[next], surfels[next]);
    }
    RILIEVO_RETURN_IF_ERROR(WritePage(page, of_page));
  }
  return sum;
}

absl::StatusOr<std::set<int>> ScratchSurfels::Adopt(const std::map<int, uint64_t>& sums) {
  std::map<int, uint64_t> found;
  for (int page = 0; page < blocks_.count(); ++page) {
    std::vector<Surfel> surfels(static_cast<size_t>(PointsOfPage(page, size_)));
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes,
                             blocks_.Adopt(page, surfels.size() * sizeof(Surfel)));
    std::memcpy(surfels.data(), bytes.data(), bytes.size());
    bool thinned = false;
    for (size_t i = 0; i < surfels.size(); ++i) {
      if (surfels[i].known == Surfel::kFromThinned) {
        surfels[i] = Surfel();
        thinned = true;
      }
      if (surfels[i].known == 0) continue;
      found[static_cast<int>(surfels[i].known - 1)] +=
          SumOf(int64_t{page} * kPagePoints + static_cast<int64_t>(i), surfels[i]);
    }
    if (thinned) RILIEVO_RETURN_IF_ERROR(WritePage(page, surfels));
  }
  std::set<int> whole;
  for (const auto& [part, sum] : sums) {
    if (found[part] == sum) whole.insert(part);
  }
  return whole;
}

absl::Status ScratchSurfels::WritePage(int page, const std::vector<Surfel>& surfels) {
  return blocks_.Write(page, std::span(reinterpret_cast<const uint8_t*>(surfels.data()),
                                       surfels.size() * sizeof(Surfel)));
}

absl::StatusOr<std::vector<Surfel>> ScratchSurfels::Read(int page) const {
  std::vector<Surfel> surfels(static_cast<size_t>(PointsOfPage(page, size_)));
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, blocks_.Read(page));
  if (!bytes.empty()) std::memcpy(surfels.data(), bytes.data(), bytes.size());
  return surfels;
}

}  // namespace rilievo

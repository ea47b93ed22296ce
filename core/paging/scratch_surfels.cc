#include "core/paging/scratch_surfels.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <span>
#include <type_traits>

#include "core/base/status_macros.h"

namespace rilievo {

static_assert(sizeof(Surfel) == 20 && std::is_trivially_copyable_v<Surfel>);

namespace {

std::span<const uint8_t> BytesOf(const std::vector<Surfel>& surfels) {
  return {reinterpret_cast<const uint8_t*>(surfels.data()), surfels.size() * sizeof(Surfel)};
}

}  // namespace

bool IsPossible(const Surfel& surfel) {
  const auto& [x, y, z] = surfel.normal;
  return std::isfinite(x) && std::isfinite(y) && std::isfinite(z) &&
         std::isfinite(surfel.spacing) && std::isfinite(surfel.noise);
}

absl::StatusOr<ScratchSurfels> ScratchSurfels::Create(const PagedScan& scan) {
  RILIEVO_ASSIGN_OR_RETURN(
      ScratchBlocks blocks,
      ScratchBlocks::Create(scan.scratch_folder(), "surfels", static_cast<int>(scan.pages().size()),
                            kPagePoints * static_cast<int64_t>(sizeof(Surfel))));
  return ScratchSurfels(std::move(blocks), scan.size());
}

absl::Status ScratchSurfels::Write(int page, const std::vector<Surfel>& surfels) {
  return blocks_.Write(page, BytesOf(surfels));
}

bool ScratchSurfels::Has(int page) const {
  const absl::StatusOr<std::vector<uint8_t>> bytes = blocks_.Read(page);
  const std::vector<Surfel> surfels = bytes.ok() ? SurfelsIn(*bytes, page) : std::vector<Surfel>();
  // A checksum does not tell who wrote the bytes.
  return !surfels.empty() && std::all_of(surfels.begin(), surfels.end(), IsPossible);
}

absl::StatusOr<std::vector<Surfel>> ScratchSurfels::Read(int page) const {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, blocks_.Read(page));
  std::vector<Surfel> surfels = SurfelsIn(bytes, page);
  surfels.resize(static_cast<size_t>(PointsOfPage(page, size_)));
  return surfels;
}

// None where they are not those of so many points.
std::vector<Surfel> ScratchSurfels::SurfelsIn(const std::vector<uint8_t>& bytes, int page) const {
  std::vector<Surfel> surfels(static_cast<size_t>(PointsOfPage(page, size_)));
  if (bytes.size() != surfels.size() * sizeof(Surfel)) return {};
  std::memcpy(surfels.data(), bytes.data(), bytes.size());
  return surfels;
}

}  // namespace rilievo

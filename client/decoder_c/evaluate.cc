#include <algorithm>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/decoder_c/guarded.h"
#include "client/decoder_c/surface.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/evaluate/closest_point_finder.h"
#include "core/evaluate/displaced_evaluator.h"

struct RilievoEvaluator {
  rilievo::DisplacedEvaluator evaluator;
};

struct RilievoFinder {
  rilievo::ClosestPointFinder finder;
};

namespace rilievo::decoder_c {
namespace {

constexpr int64_t kPlacesPerBlock = 256;

RunContext ContextOf(int threads) {
  RunContext context;
  context.threads = Threads(threads);
  return context;
}

DisplacedSurface SurfaceOf(const RilievoSurface& surface, int smooth) {
  DisplacedSurface shown = surface.decoded.surface;
  if (smooth != 0) std::fill(shown.heights.begin(), shown.heights.end(), 0.f);
  return shown;
}

void WriteJet(const SurfaceJet& jet, double* numbers) {
  const SurfaceShape shape = ShapeOf(jet);
  for (const Eigen::Vector3d& vector :
       {jet.position, jet.u, jet.v, jet.uu, jet.uv, jet.vv, shape.normal}) {
    numbers = std::copy_n(vector.data(), 3, numbers);
  }
  numbers[0] = shape.least_curvature;
  numbers[1] = shape.greatest_curvature;
}

absl::Status Evaluate(const DisplacedEvaluator& evaluator, const uint32_t* faces,
                      const double* parameters, size_t count, const RunContext& context,
                      double* jets) {
  for (size_t i = 0; i < count; ++i) {
    const absl::Status fits = evaluator.Check(faces[i], parameters[2 * i], parameters[2 * i + 1]);
    if (!fits.ok()) {
      return absl::InvalidArgumentError(absl::StrCat("parameter ", i, ": ", fits.message()));
    }
  }
  return ParallelFor(
      static_cast<int64_t>(count), kPlacesPerBlock, context, [&](int64_t begin, int64_t end) {
        std::vector<DisplacedEvaluator::Parameter> places;
        for (int64_t i = begin; i < end; ++i) {
          places.push_back({static_cast<int>(faces[i]), parameters[2 * i], parameters[2 * i + 1]});
        }
        std::vector<SurfaceJet> found(places.size());
        evaluator.AtAll(places, JetOrder::kSecond, found.data());
        double* numbers = jets + RILIEVO_JET_SIZE * begin;
        for (const SurfaceJet& jet : found) {
          WriteJet(jet, numbers);
          numbers += RILIEVO_JET_SIZE;
        }
      });
}

}  // namespace
}  // namespace rilievo::decoder_c

RilievoCode rilievo_evaluator_create(const RilievoSurface* surface, int smooth, int threads,
                                     RilievoEvaluator** evaluator) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(evaluator, "evaluator"));
    *evaluator = nullptr;
    RILIEVO_RETURN_IF_ERROR(NotNull(surface, "surface"));
    auto made = std::make_unique<RilievoEvaluator>();
    RILIEVO_ASSIGN_OR_RETURN(made->evaluator, rilievo::DisplacedEvaluator::Build(
                                                  SurfaceOf(*surface, smooth), ContextOf(threads)));
    *evaluator = made.release();
    return absl::OkStatus();
  });
}

void rilievo_evaluator_free(RilievoEvaluator* evaluator) { delete evaluator; }

RilievoCode rilievo_evaluate(const RilievoEvaluator* evaluator, const uint32_t* faces,
                             const double* parameters, size_t count, int threads, double* jets) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(evaluator, "evaluator"));
    if (count == 0) return absl::OkStatus();
    RILIEVO_RETURN_IF_ERROR(NotNull(faces, "faces"));
    RILIEVO_RETURN_IF_ERROR(NotNull(parameters, "parameters"));
    RILIEVO_RETURN_IF_ERROR(NotNull(jets, "jets"));
    return Evaluate(evaluator->evaluator, faces, parameters, count, ContextOf(threads), jets);
  });
}

RilievoCode rilievo_finder_create(const RilievoSurface* surface, int smooth, int threads,
                                  RilievoFinder** finder) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(finder, "finder"));
    *finder = nullptr;
    RILIEVO_RETURN_IF_ERROR(NotNull(surface, "surface"));
    RILIEVO_ASSIGN_OR_RETURN(
        rilievo::ClosestPointFinder made,
        rilievo::ClosestPointFinder::Build(SurfaceOf(*surface, smooth), ContextOf(threads)));
    *finder = new RilievoFinder{std::move(made)};
    return absl::OkStatus();
  });
}

void rilievo_finder_free(RilievoFinder* finder) { delete finder; }

RilievoCode rilievo_find_closest(const RilievoFinder* finder, const double* places, size_t count,
                                 int threads, uint32_t* faces, double* parameters,
                                 double* distances, double* positions) {
  using namespace rilievo::decoder_c;
  return Guarded([&]() -> absl::Status {
    RILIEVO_RETURN_IF_ERROR(NotNull(finder, "finder"));
    if (count == 0) return absl::OkStatus();
    RILIEVO_RETURN_IF_ERROR(NotNull(places, "places"));
    RILIEVO_RETURN_IF_ERROR(NotNull(faces, "faces"));
    RILIEVO_RETURN_IF_ERROR(NotNull(parameters, "parameters"));
    RILIEVO_RETURN_IF_ERROR(NotNull(distances, "distances"));
    RILIEVO_RETURN_IF_ERROR(NotNull(positions, "positions"));
    const Eigen::Matrix3Xd columns =
        Eigen::Map<const Eigen::Matrix3Xd>(places, 3, static_cast<Eigen::Index>(count));
    RILIEVO_ASSIGN_OR_RETURN(const std::vector<rilievo::ClosestPoint> found,
                             finder->finder.Find(columns, ContextOf(threads)));
    for (size_t i = 0; i < count; ++i) {
      faces[i] = static_cast<uint32_t>(found[i].face);
      parameters[2 * i] = found[i].u;
      parameters[2 * i + 1] = found[i].v;
      distances[i] = found[i].distance;
      std::copy_n(found[i].position.data(), 3, positions + 3 * i);
    }
    return absl::OkStatus();
  });
}

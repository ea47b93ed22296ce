// The triangles of one part of a surface.
#pragma once

#include <array>
#include <cstdint>

#include "absl/status/statusor.h"
#include "core/base/run_context.h"
#include "core/surface/measure_error.h"
#include "core/surface/stored_surface.h"

namespace rilievo {

struct PartTriangles {
  Shape shape;        // of the finest level, unit frame; `filled`: of all vertices
  int64_t folds = 0;  // as CountFolds
  // Vertices of each HeightSource. One between faces counts with the first of them in the whole.
  std::array<int64_t, 3> source_counts{};
};

// Of the faces that were asked for, over the vertices they use. The faces that touch these are in
// the part.
absl::StatusOr<PartTriangles> TrianglesOfPart(const SurfacePart& part, const RunContext& context);

}  // namespace rilievo

#include <limits>

#include "absl/status/status.h"
#include "core/loop/limit_stencils.h"
#include "core/loop/sparse_rows.h"

namespace rilievo {

absl::Status AppendStencils(std::vector<LimitStencils> more, LimitStencils* all) {
  int64_t entries = static_cast<int64_t>(all->control_vertices.size());
  for (const LimitStencils& stencils : more) entries += stencils.control_vertices.size();
  if (entries > std::numeric_limits<int>::max()) {
    return absl::ResourceExhaustedError("the limit stencils have more than 2^31 - 1 entries");
  }
  all->control_vertices.reserve(static_cast<size_t>(entries));
  for (std::vector<double>* weights : {&all->position, &all->tangent_u, &all->tangent_v}) {
    weights->reserve(static_cast<size_t>(entries));
  }
  for (LimitStencils& stencils : more) {
    AppendBegins(stencils.begin, all->begin);
    AppendAll(stencils.control_vertices, all->control_vertices);
    AppendAll(stencils.position, all->position);
    AppendAll(stencils.tangent_u, all->tangent_u);
    AppendAll(stencils.tangent_v, all->tangent_v);
    AppendAll(stencils.sectors.vertices, all->sectors.vertices);
    AppendBegins(stencils.sectors.begin, all->sectors.begin);
    AppendAll(stencils.sectors.control_vertices, all->sectors.control_vertices);
    AppendAll(stencils.sectors.tangent_u, all->sectors.tangent_u);
    AppendAll(stencils.sectors.tangent_v, all->sectors.tangent_v);
    stencils = LimitStencils();
  }
  return absl::OkStatus();
}

}  // namespace rilievo

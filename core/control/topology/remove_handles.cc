#include "core/control/topology/remove_handles.h"

#include <algorithm>
#include <map>
#include <utility>
#include <vector>

#include "core/base/ablation.h"
#include "core/base/parallel_for.h"
#include "core/base/scratch_pool.h"
#include "core/base/status_macros.h"
#include "core/control/topology/nonseparating_loop.h"
#include "core/control/topology/settings.h"
#include "core/geometry/mesh_topology.h"
#include "core/geometry/vertex_normals.h"

namespace rilievo {
namespace {

// Roots the search at the loop's own vertices until it gets no shorter.
std::vector<int> Tighten(std::vector<int> loop, double radius, NonseparatingLoopFinder* finder) {
  for (;;) {
    std::vector<int> shorter = loop;
    for (const size_t part : {size_t{0}, loop.size() / 3, 2 * loop.size() / 3}) {
      const std::vector<int> found = finder->LoopAround(loop[part], radius);
      if (!found.empty() && finder->Length(found) < finder->Length(shorter)) shorter = found;
    }
    if (shorter == loop) return loop;
    loop = std::move(shorter);
  }
}

// A loop no longer than `max_length` near `root`, empty where none is found. The shortest loop
// through `root` is no longer than one that passes within `step` of it and the way there and back.
std::vector<int> ShortLoop(int root, double max_length, double step,
                           NonseparatingLoopFinder* finder) {
  const double radius = max_length / 2 + step;
  std::vector<int> loop = finder->LoopAround(root, radius);
  if (loop.empty() || finder->Length(loop) > max_length + 2 * step) return {};
  if (finder->Length(loop) > max_length) loop = Tighten(std::move(loop), radius, finder);
  if (finder->Length(loop) > max_length) loop.clear();
  return loop;
}

// Flagged vertices, within `reach` of one of which each other one lies.
std::vector<int> SpreadSeeds(std::vector<uint8_t> flagged, double reach,
                             NonseparatingLoopFinder* finder) {
  std::vector<int> seeds;
  for (int seed = 0; seed < static_cast<int>(flagged.size()); ++seed) {
    if (flagged[seed] == 0) continue;
    for (const int v : finder->Disc(seed, reach)) flagged[v] = 0;
    seeds.push_back(seed);
  }
  return seeds;
}

// Tightens the loops that FindLoops() will most likely ask for, which are off the boundary and the
// neighbourhoods of all before. The others stay empty.
absl::StatusOr<std::vector<std::vector<int>>> TightenFirstOfEach(
    const MeshTopology& topology, const std::vector<std::vector<int>>& found, double radius,
    double step, const RunContext& context, NonseparatingLoopFinder* finder,
    ScratchPool<NonseparatingLoopFinder>* finders) {
  std::vector<uint8_t> taken(topology.boundary_vertex);
  std::vector<size_t> firsts;
  for (size_t i = 0; i < found.size(); ++i) {
    const std::vector<int>& loop = found[i];
    if (loop.empty() ||
        std::any_of(loop.begin(), loop.end(), [&](int v) { return taken[v] != 0; })) {
      continue;
    }
    firsts.push_back(i);
    for (const int v : finder->Disc(loop[0], finder->Length(loop) / 2 + step)) taken[v] = 1;
    for (const int v : loop) taken[v] = 1;
  }
  std::vector<std::vector<int>> tightened(found.size());
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(static_cast<int64_t>(firsts.size()), 1, context, [&](int64_t begin, int64_t end) {
        const auto own = finders->Take();
        for (int64_t i = begin; i < end; ++i) {
          const size_t loop = firsts[i];
          tightened[loop] = Tighten(found[loop], radius, own.get());
        }
      }));
  return tightened;
}

// Loops short enough to be cut at once: no two share a face, none touches the boundary. Searched
// around the vertices flagged in `search`; out: flagged where the next search has to look, near the
// loops, as two handles may lie side by side.
absl::StatusOr<std::vector<std::vector<int>>> FindLoops(
    const MeshTopology& topology, const Eigen::Matrix3Xd& vertices, const HandleLengths& lengths,
    const LoopSupport* support, const RunContext& context, std::vector<uint8_t>* search) {
  const double max_length = lengths.longest;
  const NonseparatingLoopFinder prototype(topology, vertices);
  NonseparatingLoopFinder finder = prototype;
  // A loop within `step` of a seed lies in the seed's disc whole.
  const double step = max_length / 4;
  const double radius = max_length / 2 + step;
  std::vector<std::vector<int>> found, tightened;
  {
    ScratchPool<NonseparatingLoopFinder> finders(prototype);
    const std::vector<int> seeds = SpreadSeeds(*search, step, &finder);
    // Of two loops of one handle the first decides, so those short as they are found need no
    // tightening yet.
    found.resize(seeds.size());
    RILIEVO_RETURN_IF_ERROR(ParallelFor(
        static_cast<int64_t>(seeds.size()), kHeavyBlock, context, [&](int64_t begin, int64_t end) {
          const auto own = finders.Take();
          for (int64_t i = begin; i < end; ++i) {
            found[i] = ShortLoop(seeds[i], max_length, step, own.get());
          }
        }));
    RILIEVO_ASSIGN_OR_RETURN(
        tightened, TightenFirstOfEach(topology, found, radius, step, context, &finder, &finders));
  }
  std::vector<uint8_t> taken(topology.vertex_count, 0);
  std::vector<uint8_t> kept(taken), again(taken);
  // Marks what has to wait for the next search.
  const auto blocked = [&](const std::vector<int>& loop) {
    const auto flagged = [](const auto& flags) {
      return [&flags](int v) { return flags[v] != 0; };
    };
    if (loop.size() < 3 ||
        std::any_of(loop.begin(), loop.end(), flagged(topology.boundary_vertex)) ||
        std::all_of(loop.begin(), loop.end(), flagged(kept))) {
      return true;
    }
    if (std::none_of(loop.begin(), loop.end(), flagged(taken))) return false;
    for (const int v : loop) again[v] = 1;
    return true;
  };
  Eigen::Matrix3Xd normals;
  const auto is_real = [&](const std::vector<int>& loop) {
    if (support == nullptr) return false;
    if (normals.cols() == 0) normals = VertexNormals(vertices, topology.faces);
    const bool is_tiny = finder.Length(loop) <= lengths.tiny;
    return support->PointsLine(loop, vertices, normals) ||
           (!is_tiny && support->PointsLeaveOpen(loop, vertices));
  };
  std::vector<std::vector<int>> loops;
  for (size_t i = 0; i < found.size(); ++i) {
    std::vector<int>& loop = found[i];
    if (blocked(loop)) continue;
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    loop =
        tightened[i].empty() ? Tighten(std::move(loop), radius, &finder) : std::move(tightened[i]);
    if (blocked(loop)) continue;
    if (is_real(loop)) {
      // Loops in so small a disc are the same handle's.
      for (const int v : finder.Disc(loop[0], finder.Length(loop) / 2)) kept[v] = 1;
      for (const int v : loop) kept[v] = 1;
      continue;
    }
    // The neighbourhood is spoken for: another loop there may be the same handle's.
    for (const int v : finder.Disc(loop[0], finder.Length(loop) / 2 + step)) taken[v] = 1;
    for (const int v : loop) taken[v] = 1;
    loops.push_back(std::move(loop));
  }
  for (size_t v = 0; v < taken.size(); ++v) again[v] |= taken[v];
  *search = std::move(again);
  return loops;
}

// Opens the mesh along the loops and closes both sides of each with a fan around its centre.
ControlMesh CutAndCap(const Eigen::Matrix3Xd& vertices, const MeshTopology& topology,
                      const std::vector<std::vector<int>>& loops) {
  std::vector<int> loop_of(topology.vertex_count, -1);
  std::map<std::pair<int, int>, int> on_loop;  // directed loop edges
  for (size_t l = 0; l < loops.size(); ++l) {
    for (size_t i = 0; i < loops[l].size(); ++i) {
      loop_of[loops[l][i]] = static_cast<int>(l);
      on_loop[{loops[l][i], loops[l][(i + 1) % loops[l].size()]}] = static_cast<int>(l);
    }
  }
  // Corners at loop vertices: those left of the loop take the second copy of the vertex. Left is
  // what can be reached around the vertex, without crossing the loop, from a face left of it.
  ControlMesh cut;
  cut.faces = topology.faces;
  std::vector<Eigen::Vector3d> added;
  const int vertex_count = topology.vertex_count;
  std::map<int, int> second_copy;
  const auto copy = [&](int v) {
    const auto [it, fresh] = second_copy.try_emplace(v, 0);
    if (fresh) {
      it->second = vertex_count + static_cast<int>(added.size());
      added.push_back(vertices.col(v));
    }
    return it->second;
  };
  for (int f = 0; f < topology.face_count(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = topology.faces(k, f), b = topology.faces((k + 1) % 3, f);
      if (loop_of[a] < 0 || on_loop.count({a, b}) == 0) continue;
      // Face f lies left of the loop edge a -> b: sweep around a against the loop's way in.
      int face = f, corner = k;
      for (;;) {
        cut.faces(corner, face) = copy(a);
        // Across the edge that enters a: from corner + 2 to corner.
        const int before = (corner + 2) % 3;
        if (on_loop.count({topology.faces(before, face), a}) != 0) break;
        face = topology.face_neighbors(before, face);
        if (face < 0) break;
        corner = 0;
        while (topology.faces(corner, face) != a) ++corner;
      }
    }
  }
  std::vector<Eigen::Vector3i> caps;
  for (const std::vector<int>& loop : loops) {
    Eigen::Vector3d center = Eigen::Vector3d::Zero();
    for (const int v : loop) center += vertices.col(v);
    center /= static_cast<double>(loop.size());
    for (const bool left : {false, true}) {
      const int apex = vertex_count + static_cast<int>(added.size());
      added.push_back(center);
      for (size_t i = 0; i < loop.size(); ++i) {
        const int a = loop[i], b = loop[(i + 1) % loop.size()];
        // Faces left of the loop run a -> b, so their cap runs b -> a.
        if (left) {
          caps.push_back({second_copy[b], second_copy[a], apex});
        } else {
          caps.push_back({a, b, apex});
        }
      }
    }
  }
  cut.vertices.resize(3, vertex_count + static_cast<int64_t>(added.size()));
  cut.vertices.leftCols(vertex_count) = vertices;
  for (size_t i = 0; i < added.size(); ++i) cut.vertices.col(vertex_count + i) = added[i];
  const int64_t face_count = cut.faces.cols();
  cut.faces.conservativeResize(3, face_count + static_cast<int64_t>(caps.size()));
  for (size_t i = 0; i < caps.size(); ++i) cut.faces.col(face_count + i) = caps[i];
  return cut;
}

// A mesh whose faces stand in its topology alone.
struct Connected {
  Eigen::Matrix3Xd vertices;
  MeshTopology topology;
};

absl::StatusOr<Connected> Connect(ControlMesh mesh) {
  RILIEVO_ASSIGN_OR_RETURN(MeshTopology topology,
                           BuildMeshTopology(mesh.faces, static_cast<int>(mesh.vertices.cols())));
  return Connected{std::move(mesh.vertices), std::move(topology)};
}

// The vertices to search around: every handle goes through one of them.
std::vector<uint8_t> WhereHandlesAre(const Connected& connected) {
  const int count = connected.topology.vertex_count;
  NonseparatingLoopFinder finder(connected.topology, connected.vertices);
  std::vector<uint8_t> marks(static_cast<size_t>(count), 0), seen(marks);
  for (int v = 0; v < count; ++v) {
    if (seen[v] != 0) continue;
    for (const int w : finder.MarkLoops(v, &marks)) seen[w] = 1;
  }
  return marks;
}

// Cuts the handles of one search; returns how many.
absl::StatusOr<int> CutHandles(const HandleLengths& lengths, const LoopSupport* support,
                               const RunContext& context, Connected* connected) {
  int removed = 0;
  std::vector<uint8_t> search = WhereHandlesAre(*connected);
  for (int sweep = 0; sweep < kRemoveHandles.max_sweeps; ++sweep) {
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    search.resize(connected->topology.vertex_count, 1);  // the caps
    RILIEVO_ASSIGN_OR_RETURN(
        const std::vector<std::vector<int>> loops,
        FindLoops(connected->topology, connected->vertices, lengths, support, context, &search));
    if (loops.empty()) break;
    ControlMesh cut = CutAndCap(connected->vertices, connected->topology, loops);
    ControlMesh before{std::move(connected->vertices), std::move(connected->topology.faces)};
    connected->topology = MeshTopology();  // makes room for the next
    absl::StatusOr<Connected> next = Connect(std::move(cut));
    if (!next.ok()) {  // a handle too many is better than no surface
      RILIEVO_ASSIGN_OR_RETURN(*connected, Connect(std::move(before)));
      break;
    }
    *connected = *std::move(next);
    removed += static_cast<int>(loops.size());
  }
  return removed;
}

}  // namespace

absl::StatusOr<HandleRemoval> RemoveHandles(ControlMesh mesh,
                                            std::span<const HandleLengths> searches,
                                            const LoopSupport* support, const RunContext& context) {
  if (IsLeftOut(Mechanism::kHandles)) return HandleRemoval{std::move(mesh), 0};
  RILIEVO_ASSIGN_OR_RETURN(Connected connected, Connect(std::move(mesh)));
  const int64_t genus = Genus(connected.topology);
  int removed = 0;
  for (const HandleLengths& lengths : searches) {
    if (removed == genus) break;
    RILIEVO_ASSIGN_OR_RETURN(const int cut, CutHandles(lengths, support, context, &connected));
    removed += cut;
  }
  ControlMesh clean;
  clean.vertices = std::move(connected.vertices);
  clean.faces = std::move(connected.topology.faces);
  return HandleRemoval{std::move(clean), removed};
}

}  // namespace rilievo

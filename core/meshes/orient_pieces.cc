#include <Eigen/Geometry>
#include <utility>

#include "core/base/status_macros.h"
#include "core/geometry/mesh_topology.h"
#include "core/meshes/linked_triangles.h"

namespace rilievo {
namespace {

// The other way round: corner 0 stays, so the half-edge of corner k becomes that of corner 2 - k.
void TurnOver(const std::vector<uint8_t>& turned, LinkedTriangles* mesh) {
  const auto renamed = [&](uint32_t h) {
    return h == kNoHalfEdge || turned[h / 3] == 0 ? h : h / 3 * 3 + 2 - h % 3;
  };
  for (uint32_t& h : mesh->partner) h = renamed(h);
  for (size_t face = 0; face < turned.size(); ++face) {
    if (turned[face] == 0) continue;
    std::swap(mesh->faces(1, face), mesh->faces(2, face));
    std::swap(mesh->partner[3 * face], mesh->partner[3 * face + 2]);
    ++mesh->flipped;
  }
}

// What is known of a piece while its triangles are turned alike.
struct Piece {
  std::vector<int> faces;
  double double_area = 0, squared_edges = 0;
  double balance = 0;         // double area of those that stay less that of those turned
  double sixfold_volume = 0;  // as turned
  bool is_closed = true, is_mixed = false;

  // Collinear to the last digits.
  bool is_flat() const { return double_area < 1e-13 * squared_edges; }
  // A closed piece whose triangles do not agree faces outwards; else the side of most area is
  // right: a void faces inwards.
  bool must_turn() const { return is_closed && is_mixed ? sixfold_volume < 0 : balance < 0; }
};

void AddFace(int face, bool is_turned, const LinkedTriangles& mesh, Piece* piece) {
  const auto corner = [&](int k) { return mesh.vertices.col(mesh.faces(k, face)); };
  const double area = mesh.DoubleArea(face), sign = is_turned ? -1 : 1;
  piece->double_area += area;
  piece->balance += sign * area;
  piece->is_mixed = piece->is_mixed || is_turned;
  piece->sixfold_volume += sign * corner(0).dot(corner(1).cross(corner(2)));
  for (int k = 0; k < 3; ++k) {
    piece->squared_edges += (corner(k) - corner(kNextCorner[k])).squaredNorm();
    piece->is_closed = piece->is_closed && mesh.partner[3 * face + k] != kNoHalfEdge;
  }
}

// Takes faces out whose neighbours go too.
void RemoveFaces(const std::vector<uint8_t>& removed, LinkedTriangles* mesh) {
  std::vector<uint32_t> renamed(removed.size());
  uint32_t kept = 0;
  for (size_t face = 0; face < removed.size(); ++face) {
    if (removed[face] == 0) renamed[face] = kept++;
  }
  for (size_t face = 0; face < removed.size(); ++face) {
    if (removed[face] != 0) continue;
    mesh->faces.col(renamed[face]) = Eigen::Vector3i(mesh->faces.col(static_cast<int64_t>(face)));
    for (size_t k = 0; k < 3; ++k) {
      const uint32_t across = mesh->partner[3 * face + k];
      mesh->partner[3 * renamed[face] + k] =
          across == kNoHalfEdge ? across : 3 * renamed[across / 3] + across % 3;
    }
  }
  mesh->faces.conservativeResize(3, kept);
  mesh->partner.resize(size_t{3} * kept);
}

}  // namespace

void LinkPairs(LinkedTriangles* mesh) {
  mesh->partner.assign(static_cast<size_t>(3 * mesh->faces.cols()), kNoHalfEdge);
  ForEachEdge(mesh->faces, static_cast<int>(mesh->vertices.cols()),
              [&](int, int, const HalfEdgeGroup& group) {
                if (group.size() == 2) mesh->Link(group[0], group[1]);
              });
}

absl::Status OrientPieces(const RunContext& context, LinkedTriangles* mesh) {
  const auto count = static_cast<size_t>(mesh->faces.cols());
  constexpr uint8_t kUnseen = 2;
  std::vector<uint8_t> turned(count, kUnseen), removed(count, 0);
  Piece piece;
  for (size_t seed = 0; seed < count; ++seed) {
    if (turned[seed] != kUnseen) continue;
    RILIEVO_RETURN_IF_ERROR(context.CheckStop());
    std::vector<int> room = std::move(piece.faces);
    room.assign(1, static_cast<int>(seed));
    piece = Piece();
    piece.faces = std::move(room);
    turned[seed] = 0;
    for (size_t next = 0; next < piece.faces.size(); ++next) {
      const int face = piece.faces[next];
      AddFace(face, turned[face] != 0, *mesh, &piece);
      for (int k = 0; k < 3; ++k) {
        const auto h = static_cast<uint32_t>(3 * face + k);
        const uint32_t across = mesh->partner[h];
        if (across == kNoHalfEdge) continue;
        const bool same_way = Origin(mesh->faces, h) == Origin(mesh->faces, across);
        const auto wanted = static_cast<uint8_t>(turned[face] ^ (same_way ? 1 : 0));
        uint8_t& other = turned[across / 3];
        if (other == kUnseen) {
          other = wanted;
          piece.faces.push_back(static_cast<int>(across / 3));
        } else if (other != wanted) {
          mesh->Open(h);
          ++mesh->opened;
          piece.is_closed = false;
        }
      }
    }
    for (const int face : piece.faces) {
      if (piece.must_turn()) turned[face] ^= 1;
      removed[face] = piece.is_flat();
    }
  }
  TurnOver(turned, mesh);
  RemoveFaces(removed, mesh);
  return absl::OkStatus();
}

}  // namespace rilievo

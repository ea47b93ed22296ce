#include "client/formats/tiles/tileset_writer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/formats/atomic_file.h"
#include "client/formats/export_axes.h"
#include "client/formats/glb_writer.h"
#include "client/formats/meshopt/compress_glb.h"
#include "client/formats/tiles/tile_mesh.h"
#include "client/formats/tiles/tile_tree.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

using Json = nlohmann::ordered_json;
namespace fs = std::filesystem;

// From the scan's frame about `middle` to that of the tileset.
struct TileFrame {
  Eigen::Vector3d middle;  // scan frame
  Eigen::Matrix3d turn;    // to z up
  double metres = 1;       // per unit of the scan

  TileFrame(const SpatialFrame& frame, const ScanPlace& place)
      : middle(frame.center), metres(MetresPerUnitOrOne(place)) {
    // What a runtime of 3D Tiles does to the y-up content of a tile (section 6.7.1.5.1.3).
    const Eigen::Quaterniond z_up_from_y_up = YUpFrom(UpDirection::kZ).conjugate();
    turn = (z_up_from_y_up * YUpFrom(UpOrZ(place))).toRotationMatrix();
  }

  Eigen::Vector3d FromScan(const Eigen::Vector3d& about_middle) const {
    return turn * about_middle * metres;
  }
};

Json BoxJson(const Eigen::AlignedBox3d& box) {
  const Eigen::Vector3d center = box.center(), half = box.sizes() / 2;
  return {{"box",
           {center.x(), center.y(), center.z(), half.x(), 0, 0, 0, half.y(), 0, 0, 0, half.z()}}};
}

std::string NameOf(size_t tile) { return absl::StrCat("tile_", tile, ".glb"); }

class TilesetWriter {
 public:
  TilesetWriter(const std::string& folder, const DisplacedSurface& surface, const ScanPlace& place,
                const TilesetOptions& options)
      : folder_(folder),
        surface_(surface),
        place_(place),
        options_(options),
        frame_(surface.frame, place) {}

  absl::StatusOr<WrittenTileset> Write(const RunContext& context) {
    for (int level = 0; level <= options_.finest_level; ++level) {
      RILIEVO_ASSIGN_OR_RETURN(levels_.emplace_back(), Tessellate(surface_, level, context));
      levels_.back().vertices.colwise() -= frame_.middle;
    }
    RILIEVO_ASSIGN_OR_RETURN(tiles_, CutIntoTiles(surface_.control_mesh, options_.finest_level,
                                                  options_.most_triangles));
    MeasureTiles(levels_, &tiles_);
    boxes_.resize(tiles_.size());
    for (int level = 0; level <= options_.finest_level; ++level) {
      RILIEVO_RETURN_IF_ERROR(WriteLevel(level, context));
    }
    for (size_t tile = tiles_.size(); tile-- > 0;) {  // children come after their parents
      if (tiles_[tile].parent < 0) continue;
      boxes_[static_cast<size_t>(tiles_[tile].parent)].extend(boxes_[tile]);
    }
    const std::string json = TilesetJson().dump();
    RILIEVO_RETURN_IF_ERROR(WriteFileAtomically(PathOf("tileset.json"), [&](std::ostream& out) {
      out << json;
      return absl::OkStatus();
    }));
    return WrittenTileset{static_cast<int64_t>(tiles_.size()), levels_.back().triangles.cols(),
                          bytes_ + static_cast<int64_t>(json.size())};
  }

 private:
  std::string PathOf(const std::string& name) const { return (fs::path(folder_) / name).string(); }

  absl::Status WriteLevel(int number, const RunContext& context) {
    const std::vector<HeightSource> sources = SourcesAtLevel(surface_, number);
    const std::vector<Rgb> colors = ColorsAtLevel(surface_, number);
    const SurfaceLevel level{levels_[static_cast<size_t>(number)], sources, colors,
                             1 << (2 * number)};
    HalfEdges rims;
    for (const SurfaceTile& tile : tiles_) {
      if (tile.level != number) continue;
      const HalfEdges rim = RimOf(level, tile);
      rims.insert(rims.end(), rim.begin(), rim.end());
    }
    std::sort(rims.begin(), rims.end());
    for (size_t i = 0; i < tiles_.size(); ++i) {
      if (tiles_[i].level != number) continue;
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      RILIEVO_RETURN_IF_ERROR(WriteTile(i, MeshOfTile(level, tiles_[i], rims, SkirtOf(tiles_[i]))));
    }
    return absl::OkStatus();
  }

  // A neighbour may be as coarse as the tile above this one.
  double SkirtOf(const SurfaceTile& tile) const {
    return tile.parent < 0 ? tile.error : tiles_[static_cast<size_t>(tile.parent)].error;
  }

  absl::Status WriteTile(size_t number, const TileMesh& tile) {
    for (Eigen::Index v = 0; v < tile.mesh.vertices.cols(); ++v) {
      boxes_[number].extend(frame_.FromScan(tile.mesh.vertices.col(v)));
    }
    return WriteFileAtomically(PathOf(NameOf(number)), [&](std::ostream& out) {
      const auto write = options_.compressed ? WriteCompressedGlbMesh : WriteGlbMesh;
      RILIEVO_RETURN_IF_ERROR(write(tile.mesh, tile.sources, out, tile.layers, place_, nullptr));
      bytes_ += static_cast<int64_t>(out.tellp());
      return absl::OkStatus();
    });
  }

  Json TileJson(size_t number) const {
    const SurfaceTile& tile = tiles_[number];
    Json json = {{"boundingVolume", BoxJson(boxes_[number])},
                 {"geometricError", tile.error * frame_.metres},
                 {"refine", "REPLACE"},
                 {"content", {{"uri", NameOf(number)}}}};
    for (const int child : tile.children) {
      json["children"].push_back(TileJson(static_cast<size_t>(child)));
    }
    return json;
  }

  // The tile above all others, or a tile without content above those that have none.
  Json RootJson() const {
    std::vector<size_t> tops;
    for (size_t i = 0; i < tiles_.size(); ++i) {
      if (tiles_[i].parent < 0) tops.push_back(i);
    }
    if (tops.size() == 1) return TileJson(tops.front());
    Eigen::AlignedBox3d box;
    for (const size_t top : tops) box.extend(boxes_[top]);
    Json json = {{"boundingVolume", BoxJson(box)},
                 {"geometricError", box.diagonal().norm()},
                 {"refine", "REPLACE"}};
    for (const size_t top : tops) json["children"].push_back(TileJson(top));
    return json;
  }

  Json TilesetJson() const {
    Json root = RootJson();
    const Eigen::Vector3d to = frame_.FromScan(frame_.middle);
    root["transform"] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, to.x(), to.y(), to.z(), 1};
    Json extras = {{"generator", "rilievo"}};
    if (!place_.crs.empty()) extras["crs"] = place_.crs;
    const double metres = surface_.frame.diagonal * frame_.metres;
    return {{"asset", {{"version", "1.1"}, {"extras", extras}}},
            {"geometricError", std::max(metres, root["geometricError"].get<double>())},
            {"root", root}};
  }

  const std::string folder_;
  const DisplacedSurface& surface_;
  const ScanPlace& place_;
  const TilesetOptions options_;
  const TileFrame frame_;
  std::vector<TriangleMesh> levels_;  // about the middle
  std::vector<SurfaceTile> tiles_;
  std::vector<Eigen::AlignedBox3d> boxes_;  // of each tile and those below, in the tileset's frame
  int64_t bytes_ = 0;
};

}  // namespace

absl::StatusOr<WrittenTileset> WriteTileset(const std::string& folder,
                                            const DisplacedSurface& surface, const ScanPlace& place,
                                            const TilesetOptions& options,
                                            const RunContext& context) {
  if (options.finest_level < 0 || options.finest_level > surface.max_level) {
    return absl::InvalidArgumentError(absl::StrCat("level = ", options.finest_level,
                                                   ": tiles can be written for 0 to ",
                                                   surface.max_level, ", the levels of heights"));
  }
  return TilesetWriter(folder, surface, place, options).Write(context);
}

}  // namespace rilievo

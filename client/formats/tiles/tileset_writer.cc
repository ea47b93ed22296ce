#include "client/formats/tiles/tileset_writer.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <system_error>
#include <utility>
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

constexpr char kTilesetName[] = "tileset.json", kGenerator[] = "rilievo";

std::string NameOf(size_t tile) { return absl::StrCat("tile_", tile, ".glb"); }

// So that at no time a tileset.json names the tiles of another one. Tiles go only with a
// tileset.json that was written here.
absl::Status RemoveOldTileset(const fs::path& folder) {
  std::ifstream in(folder / kTilesetName);
  if (!in) return absl::OkStatus();
  const Json old = Json::parse(in, nullptr, /*allow_exceptions=*/false);
  const Json::json_pointer generator("/asset/extras/generator");
  const bool ours = old.is_object() && old.contains(generator) && old[generator] == kGenerator;
  std::error_code error;
  fs::remove(folder / kTilesetName, error);
  for (size_t tile = 0; ours && !error && fs::remove(folder / NameOf(tile), error);) ++tile;
  if (!error) return absl::OkStatus();
  return absl::PermissionDeniedError(absl::StrCat(
      folder.string(), ": the tileset that is there cannot be removed: ", error.message()));
}

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
    RILIEVO_RETURN_IF_ERROR(RemoveOldTileset(folder_));
    for (int level = 0; level <= options_.finest_level; ++level) {
      RILIEVO_RETURN_IF_ERROR(WriteLevel(level, context));
    }
    for (size_t tile = tiles_.size(); tile-- > 0;) {  // children come after their parents
      if (tiles_[tile].parent < 0) continue;
      boxes_[static_cast<size_t>(tiles_[tile].parent)].extend(boxes_[tile]);
    }
    const std::string json = TilesetJson().dump();
    RILIEVO_RETURN_IF_ERROR(WriteFileAtomically(PathOf(kTilesetName), [&](std::ostream& out) {
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
    std::vector<std::pair<size_t, TileMesh>> meshes;
    for (size_t i = 0; i < tiles_.size(); ++i) {
      if (tiles_[i].level != number) continue;
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      meshes.emplace_back(i, MeshOfTile(level, tiles_[i], rims));
    }
    if (options_.compressed) PutOnGrid(&meshes);
    for (const auto& [i, mesh] : meshes) {
      RILIEVO_RETURN_IF_ERROR(context.CheckStop());
      RILIEVO_RETURN_IF_ERROR(WriteTile(i, mesh));
    }
    return absl::OkStatus();
  }

  // One grid for the tiles of a level, as fine as 16 bits allow the largest of them: on grids of
  // their own the vertices that two tiles share would come apart.
  void PutOnGrid(std::vector<std::pair<size_t, TileMesh>>* meshes) {
    double longest = 0;
    for (const auto& [i, tile] : *meshes) {
      const Eigen::Matrix3Xd& vertices = tile.mesh.vertices;
      longest = std::max(
          longest, (vertices.rowwise().maxCoeff() - vertices.rowwise().minCoeff()).maxCoeff());
    }
    constexpr double kMostSteps = 65534;  // 65535, and rounding
    step_ = longest / kMostSteps;
    if (!(step_ > 0)) return;
    for (auto& [i, tile] : *meshes) {
      tile.mesh.vertices = (tile.mesh.vertices / step_).array().round().matrix() * step_;
    }
  }

  absl::Status WriteTile(size_t number, const TileMesh& tile) {
    for (Eigen::Index v = 0; v < tile.mesh.vertices.cols(); ++v) {
      boxes_[number].extend(frame_.FromScan(tile.mesh.vertices.col(v)));
    }
    return WriteFileAtomically(PathOf(NameOf(number)), [&](std::ostream& out) {
      RILIEVO_RETURN_IF_ERROR(
          options_.compressed ? WriteCompressedGlbMesh(tile.mesh, tile.sources, out, tile.layers,
                                                       place_, nullptr, step_)
                              : WriteGlbMesh(tile.mesh, tile.sources, out, tile.layers, place_));
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
    Json extras = {{"generator", kGenerator}};
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
  double step_ = 0;                         // of the grid of the level at hand, scan unit
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

#include "client/picture/render.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/picture/edge_lines.h"
#include "client/picture/point_shading.h"
#include "client/picture/raster.h"
#include "core/base/parallel_for.h"
#include "core/base/status_macros.h"
#include "core/geometry/vertex_normals.h"

namespace rilievo {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr int kSamples = 2;  // along each side of a pixel
const Vector3f kStone(0.66f, 0.62f, 0.54f);
constexpr int64_t kVertexBlock = 8192;

struct DrawnVertex {
  Projected at;
  Vector3f normal;
};

absl::Status CheckScene(const Scene& scene) {
  const TriangleMesh& mesh = scene.mesh;
  const Eigen::Index count = mesh.vertices.cols();
  if (mesh.triangles.cols() > 0 &&
      (mesh.triangles.minCoeff() < 0 || mesh.triangles.maxCoeff() >= count)) {
    return absl::InvalidArgumentError("picture: a triangle names a vertex that does not exist");
  }
  if (scene.colors.cols() != 0 && scene.colors.cols() != count) {
    return absl::InvalidArgumentError(
        absl::StrCat("picture: ", scene.colors.cols(), " colours for ", count, " vertices"));
  }
  return absl::OkStatus();
}

absl::StatusOr<std::vector<DrawnVertex>> ProjectVertices(const Scene& scene,
                                                         const Projection& projection,
                                                         const RunContext& context) {
  const TriangleMesh& mesh = scene.mesh;
  const Eigen::Index count = mesh.vertices.cols();
  Eigen::Matrix3Xd computed;
  if (mesh.normals.cols() != count) computed = VertexNormals(mesh.vertices, mesh.triangles);
  const Eigen::Matrix3Xd& normals = mesh.normals.cols() == count ? mesh.normals : computed;
  std::vector<DrawnVertex> drawn(static_cast<size_t>(count));
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(count, kVertexBlock, context, [&](int64_t begin, int64_t end) {
        for (int64_t i = begin; i < end; ++i) {
          const Vector3d n = projection.view_from_scene() * normals.col(i);
          const double norm = n.norm();
          drawn[static_cast<size_t>(i)] = {
              projection.Project(mesh.vertices.col(i)),
              norm > 0 ? Vector3f((n / norm).cast<float>()) : Vector3f(Vector3f::Zero())};
        }
      }));
  return drawn;
}

absl::Status DrawSurface(const Scene& scene, const PictureOptions& options,
                         const Projection& projection, const RunContext& context, Raster* raster) {
  const TriangleMesh& mesh = scene.mesh;
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<DrawnVertex> drawn,
                           ProjectVertices(scene, projection, context));
  const bool colored = scene.colors.cols() > 0;
  const auto draw = [&](Eigen::Index f, int row_begin, int row_end) {
    const Eigen::Vector3i triangle = mesh.triangles.col(f);
    const auto row = [&](int k) { return drawn[static_cast<size_t>(triangle(k))].at.y; };
    const auto [low, high] = std::minmax({row(0), row(1), row(2)});
    if (!(high >= static_cast<float>(row_begin) && low <= static_cast<float>(row_end))) return;
    RasterCorner corners[3];
    for (int k = 0; k < 3; ++k) {
      const DrawnVertex& vertex = drawn[static_cast<size_t>(triangle(k))];
      corners[k] = {vertex.at, vertex.normal,
                    colored ? Vector3f(scene.colors.col(triangle(k))) : kStone};
    }
    const Vector3d a = mesh.vertices.col(mesh.triangles(0, f));
    const Vector3f towards = projection.TowardsCamera(a).cast<float>();
    if (options.flat) {
      const Vector3d b = mesh.vertices.col(mesh.triangles(1, f));
      const Vector3d c = mesh.vertices.col(mesh.triangles(2, f));
      const Vector3d normal = projection.view_from_scene() * (b - a).cross(c - a).normalized();
      for (RasterCorner& corner : corners) corner.normal = normal.cast<float>();
    }
    const bool back = SignedDoubleArea(corners[0].at, corners[1].at, corners[2].at) < 0;
    DrawTriangle(corners, towards, back, row_begin, row_end, raster);
  };
  // Bands of rows, each drawn by one thread in the order of the triangles.
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(raster->height, kRowBlock, context, [&](int64_t begin, int64_t end) {
        for (Eigen::Index f = 0; f < mesh.triangles.cols(); ++f) {
          draw(f, static_cast<int>(begin), static_cast<int>(end));
        }
      }));
  if (!options.edges) return absl::OkStatus();
  std::vector<Projected> at;
  for (const DrawnVertex& vertex : drawn) at.push_back(vertex.at);
  return DrawEdges(mesh, at, projection, context, raster);
}

// Radius at which discs of the points that fall on a cell about cover it twice, a cell each of
// kCell x kCell samples, from the counts in it and around it.
class DiscSizes {
 public:
  DiscSizes(const std::vector<Projected>& points, int width, int height)
      : columns_(width / kCell + 3), rows_(height / kCell + 3) {
    counts_.assign(static_cast<size_t>(columns_) * rows_, 0);
    for (const Projected& point : points) {
      if (std::isfinite(point.x) && std::isfinite(point.y)) counts_[Cell(point)] += 1;
    }
    std::vector<float> filled;
    for (int count : counts_) {
      if (count > 0) filled.push_back(static_cast<float>(count));
    }
    if (filled.empty()) return;
    const auto middle = filled.begin() + static_cast<std::ptrdiff_t>(filled.size() / 2);
    std::nth_element(filled.begin(), middle, filled.end());
    typical_ = RadiusFor(*middle);
  }

  float typical() const { return typical_; }

  float At(const Projected& point) const {
    if (!std::isfinite(point.x) || !std::isfinite(point.y)) return typical_;
    return std::clamp(RadiusFor(static_cast<float>(counts_[Cell(point)])), 0.5f * typical_,
                      1.5f * typical_);
  }

 private:
  static constexpr int kCell = 24;

  static float RadiusFor(float count) {
    return std::clamp(1.5f * kCell / std::sqrt(std::max(1.f, count)), 1.2f, 9.f);
  }
  size_t Cell(const Projected& point) const {
    const auto index = [](float value, int cells) {
      return std::clamp(static_cast<int>(value / kCell) + 1, 0, cells - 1);
    };
    return static_cast<size_t>(index(point.y, rows_)) * columns_ + index(point.x, columns_);
  }

  int columns_, rows_;
  std::vector<int> counts_;
  float typical_ = 3;
};

absl::Status DrawPoints(const Scene& scene, const Projection& projection, const RunContext& context,
                        Raster* raster) {
  const Eigen::Index count = scene.mesh.vertices.cols();
  std::vector<Projected> at(static_cast<size_t>(count));
  for (Eigen::Index i = 0; i < count; ++i) {
    at[static_cast<size_t>(i)] = projection.Project(scene.mesh.vertices.col(i));
  }
  const DiscSizes sizes(at, raster->width, raster->height);
  const bool colored = scene.colors.cols() > 0;
  RILIEVO_RETURN_IF_ERROR(
      ParallelFor(raster->height, kRowBlock, context, [&](int64_t begin, int64_t end) {
        for (Eigen::Index i = 0; i < count; ++i) {
          const Projected& center = at[static_cast<size_t>(i)];
          const float radius = sizes.At(center);
          if (!(center.y + radius >= static_cast<float>(begin) &&
                center.y - radius <= static_cast<float>(end))) {
            continue;
          }
          DrawDisc(center, radius, colored ? Vector3f(scene.colors.col(i)) : kStone,
                   static_cast<int>(begin), static_cast<int>(end), raster);
        }
      }));
  return ShadePoints(projection, sizes.typical(), context, raster);
}

}  // namespace

absl::Status PictureOptions::Validate() const {
  for (int side : {width, height}) {
    if (side < 16 || side > 16384) {
      return absl::InvalidArgumentError(
          absl::StrCat("picture size ", width, " x ", height, "; each must lie in [16, 16384]"));
    }
  }
  if (!(camera.field_of_view_degrees > 1 && camera.field_of_view_degrees < 120) ||
      !(std::abs(camera.elevation_degrees) <= 90) || !std::isfinite(camera.turn_degrees)) {
    return absl::InvalidArgumentError(absl::StrCat(
        "camera: field of view ", camera.field_of_view_degrees, " must lie in (1, 120), elevation ",
        camera.elevation_degrees, " in [-90, 90] degrees, the turn must be finite"));
  }
  return absl::OkStatus();
}

absl::StatusOr<Image> RenderPicture(const Scene& scene, const PictureOptions& options,
                                    const RunContext& context) {
  RILIEVO_RETURN_IF_ERROR(options.Validate());
  RILIEVO_RETURN_IF_ERROR(CheckScene(scene));
  Raster raster(kSamples * options.width, kSamples * options.height);
  const Projection projection(
      options.camera,
      options.steady ? CylinderAround(scene.mesh.vertices, options.camera) : scene.mesh.vertices,
      raster.width, raster.height);
  RILIEVO_RETURN_IF_ERROR(scene.mesh.triangles.cols() > 0
                              ? DrawSurface(scene, options, projection, context, &raster)
                              : DrawPoints(scene, projection, context, &raster));
  return Downsample(raster);
}

absl::StatusOr<Image> RenderSheet(const Scene& scene, const PictureOptions& options, int views,
                                  const RunContext& context) {
  if (views < 2 || views > 4) {
    return absl::InvalidArgumentError(
        absl::StrCat("a sheet of ", views, " views; it must be 2, 3 or 4"));
  }
  const int columns = views == 4 ? 2 : views, rows = views == 4 ? 2 : 1;
  PictureOptions part = options;
  part.width = options.width / columns;
  part.height = options.height / rows;
  std::vector<Image> images;
  for (int view = 0; view < views; ++view) {
    part.camera = options.camera;
    if (view == 1) part.camera.turn_degrees += 180;
    if (view == 2) part.camera.elevation_degrees = 89;
    if (view == 3) part.camera.elevation_degrees = -50;
    RILIEVO_ASSIGN_OR_RETURN(Image image, RenderPicture(scene, part, context));
    images.push_back(std::move(image));
  }
  return TileImages(images, columns);
}

}  // namespace rilievo

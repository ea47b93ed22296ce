#include "client/cli/loaded_shape.h"

#include <fstream>
#include <iterator>
#include <limits>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/exit_code.h"
#include "client/cli/text_layout.h"
#include "client/formats/file_kind.h"
#include "client/formats/mesh_reader.h"
#include "client/formats/open_input.h"
#include "core/base/status_macros.h"
#include "core/surface/displaced_surface.h"

namespace rilievo {
namespace {

absl::Status AtPath(const std::string& path, const absl::Status& status) {
  return absl::Status(status.code(), absl::StrCat(path, ": ", status.message()));
}

// PLY, OBJ, STL, PCD or text: anything that is no .dss.
bool IsDss(const std::string& path) {
  absl::StatusOr<std::ifstream> file = OpenFile(path);
  if (!file.ok()) return Extension(path) == "dss";
  HeadedInput input(*file);
  const absl::StatusOr<FileKind> kind = RecognizeFile(input.head(), input.size(), path);
  return kind.ok() && *kind == FileKind::kDss;
}

absl::StatusOr<LoadedShape> LoadSurface(const std::string& path, std::optional<int> level,
                                        const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded, LoadDss(path, context));
  const DisplacedSurface& surface = decoded.surface;
  const int used = level.value_or(surface.max_level);
  absl::StatusOr<TriangleMesh> mesh = Tessellate(surface, used, context);
  if (!mesh.ok()) return AtPath(path, mesh.status());
  LoadedShape shape;
  shape.mesh = *std::move(mesh);
  for (HeightSource source : SourcesAtLevel(surface, used)) {
    shape.sources.push_back(static_cast<uint8_t>(source));
  }
  const auto count = static_cast<size_t>(shape.mesh.vertices.cols());
  if (count <= surface.heights.size()) {
    shape.heights.assign(surface.heights.begin(),
                         surface.heights.begin() + static_cast<std::ptrdiff_t>(count));
  }
  shape.description =
      absl::StrCat("surface at level ", used, ", ", Grouped(shape.mesh.triangles.cols()), " faces");
  return shape;
}

}  // namespace

absl::StatusOr<std::vector<uint8_t>> ReadBytes(const std::string& path) {
  RILIEVO_ASSIGN_OR_RETURN(std::ifstream file, OpenFile(path));
  std::vector<uint8_t> bytes{std::istreambuf_iterator<char>(file),
                             std::istreambuf_iterator<char>()};
  if (file.bad()) return absl::DataLossError(absl::StrCat(path, ": cannot be read to its end"));
  return bytes;
}

absl::StatusOr<DecodedSurface> LoadDss(const std::string& path, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, ReadBytes(path));
  absl::StatusOr<DecodedSurface> decoded = DecodeDss(bytes, context);
  if (!decoded.ok()) return AtPath(path, decoded.status());
  return decoded;
}

absl::StatusOr<LoadedShape> LoadShape(const std::string& path, std::optional<int> level,
                                      const RunContext& context) {
  if (IsDss(path)) return LoadSurface(path, level, context);
  RILIEVO_ASSIGN_OR_RETURN(MeshFile file, ReadMesh(path));
  if (level) {
    return WithExitCode(absl::InvalidArgumentError(absl::StrCat(
                            path, ": only a .dss surface has levels; leave --level out")),
                        ExitCode::kUsage);
  }
  LoadedShape shape;
  shape.mesh = std::move(file.mesh);
  shape.sources = std::move(file.source);
  shape.description =
      shape.mesh.triangles.cols() > 0
          ? absl::StrCat(file.format, " mesh, ", Grouped(shape.mesh.triangles.cols()), " faces")
          : absl::StrCat(file.format, ", ", Counted(shape.mesh.vertices.cols(), "point", "points"));
  return shape;
}

double DiagonalOf(const Eigen::Matrix3Xd& vertices) {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(std::numeric_limits<double>::infinity());
  Eigen::Vector3d high = -low;
  for (Eigen::Index i = 0; i < vertices.cols(); ++i) {
    if (!vertices.col(i).allFinite()) continue;
    low = low.cwiseMin(vertices.col(i));
    high = high.cwiseMax(vertices.col(i));
  }
  return low.allFinite() ? (high - low).norm() : 0;
}

}  // namespace rilievo

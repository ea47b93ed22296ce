#include "client/cli/loaded_shape.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <istream>
#include <limits>
#include <string_view>
#include <utility>

#include "absl/strings/str_cat.h"
#include "client/cli/exit_code.h"
#include "client/formats/chosen_classes.h"
#include "client/formats/file_kind.h"
#include "client/formats/mesh_reader.h"
#include "client/formats/open_input.h"
#include "client/formats/trajectory.h"
#include "client/formats/with_input.h"
#include "core/base/status_macros.h"
#include "core/surface/displaced_surface.h"
#include "server/command_line/text_layout.h"

namespace rilievo {
namespace {

std::string NameOf(const std::string& path, const std::string& format) {
  return format.empty() || !Extension(NameUnpacked(path)).empty() ? path
                                                                  : absl::StrCat(path, ".", format);
}

std::vector<uint8_t> AllBytes(std::istream& in) {
  std::vector<uint8_t> bytes;
  constexpr size_t kBlock = size_t{1} << 18;
  for (size_t count = kBlock; count == kBlock;) {
    const size_t before = bytes.size();
    bytes.resize(before + kBlock);
    in.read(reinterpret_cast<char*>(bytes.data() + before), kBlock);
    count = static_cast<size_t>(in.gcount());
    bytes.resize(before + count);
  }
  return bytes;
}

// Passes points on and counts them.
class CountingSink : public PointSink {
 public:
  explicit CountingSink(PointSink* sink) : sink_(*sink) {}
  absl::Status Expect(uint64_t points) override { return sink_.Expect(points); }
  absl::Status Take(const Eigen::Ref<const Eigen::Matrix3Xd>& points) override {
    count_ += points.cols();
    return sink_.Take(points);
  }
  int64_t count() const { return count_; }

 private:
  PointSink& sink_;
  int64_t count_ = 0;
};

// Of the formats that hold nothing but meshes.
absl::StatusOr<ScanFile> ReadMeshVertices(std::istream& in, const std::string& name,
                                          const WantedLayers& wanted) {
  RILIEVO_ASSIGN_OR_RETURN(MeshFile file, ReadMeshStream(in, name));
  ScanFile scan;
  if (wanted.sink != nullptr) {
    RILIEVO_RETURN_IF_ERROR(wanted.sink->Take(file.mesh.vertices));
  } else {
    scan.cloud.points = std::move(file.mesh.vertices);
  }
  if (wanted.colors) scan.cloud.sights.colors = std::move(file.colors);
  scan.format = std::move(file.format);
  scan.faces = static_cast<uint64_t>(file.mesh.triangles.cols());
  scan.place = std::move(file.place);
  return scan;
}

LoadedShape ControlMeshOf(const DecodedSurface& decoded) {
  const DisplacedSurface& surface = decoded.surface;
  LoadedShape shape;
  shape.place = decoded.metadata.place;
  shape.mesh.vertices.resize(3, surface.control_mesh.vertices.cols());
  for (Eigen::Index i = 0; i < shape.mesh.vertices.cols(); ++i) {
    shape.mesh.vertices.col(i) = surface.frame.ScanFromUnit(surface.control_mesh.vertices.col(i));
  }
  shape.mesh.triangles = surface.control_mesh.faces;
  shape.description =
      absl::StrCat("control mesh, ", Grouped(shape.mesh.triangles.cols()), " faces");
  return shape;
}

absl::StatusOr<LoadedShape> ShapeOf(const DecodedSurface& decoded, std::optional<int> level,
                                    ShownPart part, const RunContext& context) {
  if (part == ShownPart::kControlMesh) return ControlMeshOf(decoded);
  DisplacedSurface surface = decoded.surface;
  const int used = level.value_or(surface.max_level);
  LoadedShape shape;
  shape.place = decoded.metadata.place;
  shape.diagonal = surface.frame.diagonal;
  shape.colors = ColorsAtLevel(surface, used);
  const auto count_at = [&] { return static_cast<size_t>(shape.mesh.vertices.cols()); };
  const std::vector<float> heights = surface.heights;
  if (part == ShownPart::kDomain) std::fill(surface.heights.begin(), surface.heights.end(), 0.f);
  RILIEVO_ASSIGN_OR_RETURN(shape.mesh, Tessellate(surface, used, context));
  for (HeightSource source : SourcesAtLevel(surface, used)) {
    shape.sources.push_back(static_cast<uint8_t>(source));
  }
  const auto at_level = [&](const std::vector<float>& values) {
    if (count_at() > values.size()) return std::vector<float>();
    return std::vector<float>(values.begin(),
                              values.begin() + static_cast<std::ptrdiff_t>(count_at()));
  };
  shape.heights = at_level(heights);
  shape.changes = at_level(decoded.height_changes);
  shape.description =
      absl::StrCat(part == ShownPart::kDomain ? "smooth surface" : "surface", " at level ", used,
                   ", ", Grouped(shape.mesh.triangles.cols()), " faces");
  return shape;
}

LoadedShape ShapeOf(MeshFile file) {
  LoadedShape shape;
  shape.mesh = std::move(file.mesh);
  shape.place = std::move(file.place);
  shape.sources = std::move(file.source);
  shape.colors = std::move(file.colors);
  shape.description =
      shape.mesh.triangles.cols() > 0
          ? absl::StrCat(file.format, " mesh, ", Grouped(shape.mesh.triangles.cols()), " faces")
          : absl::StrCat(file.format, ", ", Counted(shape.mesh.vertices.cols(), "point", "points"));
  return shape;
}

}  // namespace

void AddFormatOption(CLI::App* app, std::string* format) {
  app->add_option("--format", *format,
                  "format of an input that is not recognised by its content or extension")
      ->check(CLI::IsMember({"ply", "pcd", "xyz", "pts", "txt", "obj", "las", "laz", "e57", "ptx",
                             "stl", "glb", "dss"}));
}

void AddScanOptions(CLI::App* app, ScanArguments* arguments) {
  app->add_flag(
      "--points-only", arguments->points_only,
      "take the vertices of a mesh (PLY and OBJ with faces, STL, GLB) as a scan; its faces are "
      "not used");
  app->add_option("--classes", arguments->classes,
                  "take the points of these classes alone, such as 2,6 (LAS: ground, buildings)")
      ->delimiter(',')
      ->check(CLI::Range(0, 255));
  app->add_flag("--last-returns", arguments->last_returns,
                "take the last return of each pulse alone (LAS, LAZ): fewer leaves where the scan "
                "has no classes");
}

void AddTrajectoryOption(CLI::App* app, ScanArguments* arguments) {
  app->add_option(
      "--trajectory", arguments->trajectory,
      "where the scanner was at the GPS times of a LAS or LAZ file: lines of time, x, y, z in the "
      "coordinates of the scan, or a table whose heading names these");
}

absl::StatusOr<ScanFile> LoadScan(const std::string& path, const ScanArguments& arguments,
                                  const WantedLayers& layers) {
  WantedLayers wanted = layers;
  wanted.classes.assign(arguments.classes.begin(), arguments.classes.end());
  wanted.last_returns = arguments.last_returns;
  std::optional<Trajectory> trajectory;
  if (wanted.stations && !arguments.trajectory.empty()) {
    RILIEVO_ASSIGN_OR_RETURN(trajectory, ReadTrajectory(arguments.trajectory));
    wanted.trajectory = &*trajectory;
  }
  std::optional<CountingSink> sink;
  if (layers.sink != nullptr) wanted.sink = &sink.emplace(layers.sink);
  return WithInput(path, [&](std::istream& in) -> absl::StatusOr<ScanFile> {
    const std::string name = NameOf(path, arguments.format);
    HeadedInput input(in);
    RILIEVO_ASSIGN_OR_RETURN(const FileKind kind, RecognizeFile(input.head(), input.size(), name));
    const bool is_mesh = kind == FileKind::kStl || kind == FileKind::kGlb;
    if (arguments.last_returns && kind != FileKind::kLas) {
      return absl::InvalidArgumentError(
          "--last-returns needs the numbers of the returns, which LAS and LAZ files have; leave it "
          "out");
    }
    if (trajectory && kind != FileKind::kLas) {
      return absl::InvalidArgumentError(
          "--trajectory needs the GPS times of its points, which LAS and LAZ files have; leave it "
          "out");
    }
    RILIEVO_ASSIGN_OR_RETURN(ScanFile scan, is_mesh ? ReadMeshVertices(input.stream(), name, wanted)
                                                    : ReadScanStream(input.stream(), name, wanted));
    if (is_mesh && !wanted.classes.empty()) {
      RILIEVO_RETURN_IF_ERROR(TellChosen(wanted.classes, &scan));
    }
    if (scan.faces == 0 || arguments.points_only) return scan;
    return absl::InvalidArgumentError(
        absl::StrCat("a mesh of ", Counted(static_cast<int64_t>(scan.faces), "face", "faces"),
                     ", not a scan; 'rilievo convert' makes a surface of it; or add --points-only "
                     "to take its ",
                     Counted(sink ? sink->count() : scan.cloud.points.cols(), "vertex", "vertices"),
                     " as the points of a scan and leave its faces out"));
  });
}

absl::StatusOr<ScanFile> LoadMesh(const std::string& path, const std::string& format,
                                  bool with_colors) {
  return WithInput(path, [&](std::istream& in) -> absl::StatusOr<ScanFile> {
    const std::string name = NameOf(path, format);
    HeadedInput input(in);
    RILIEVO_ASSIGN_OR_RETURN(const FileKind kind, RecognizeFile(input.head(), input.size(), name));
    if (kind == FileKind::kDss) {
      return absl::InvalidArgumentError(
          "a .dss file holds a surface already, not a mesh; 'rilievo export' makes a mesh of it");
    }
    RILIEVO_ASSIGN_OR_RETURN(MeshFile file, ReadMeshStream(input.stream(), name));
    if (file.mesh.triangles.cols() == 0) {
      return absl::InvalidArgumentError(absl::StrCat(
          Counted(file.mesh.vertices.cols(), "point", "points"),
          " without a face, not a mesh; 'rilievo reconstruct' makes a surface of them"));
    }
    ScanFile mesh;
    mesh.cloud.points = std::move(file.mesh.vertices);
    mesh.cloud.triangles = std::move(file.mesh.triangles);
    if (with_colors) mesh.cloud.sights.colors = std::move(file.colors);
    mesh.format = std::move(file.format);
    mesh.place = std::move(file.place);
    return mesh;
  });
}

absl::StatusOr<std::vector<uint8_t>> ReadBytes(const std::string& path) {
  return WithInput(path, [&](std::istream& in) -> absl::StatusOr<std::vector<uint8_t>> {
    std::vector<uint8_t> bytes = AllBytes(in);
    if (in.bad()) return absl::DataLossError("cannot be read to its end");
    return bytes;
  });
}

namespace {

// `read`: of these bytes; an error says of other files what they are.
absl::Status StatusOfDss(const std::string& path, const std::vector<uint8_t>& bytes,
                         const absl::Status& read) {
  const std::string_view head(reinterpret_cast<const char*>(bytes.data()),
                              std::min(bytes.size(), kHeadBytes));
  const absl::StatusOr<FileKind> kind = RecognizeFile(head, bytes.size(), path);
  if (!read.ok() && kind.ok() && *kind != FileKind::kDss) {
    return absl::InvalidArgumentError(
        absl::StrCat(path,
                     ": not a surface (.dss); 'rilievo reconstruct' makes one of a scan, "
                     "'rilievo convert' of a mesh"));
  }
  return read.ok() ? read : AtPath(path, read);
}

}  // namespace

absl::StatusOr<DecodedSurface> DecodeBytes(const std::string& path,
                                           const std::vector<uint8_t>& bytes,
                                           const RunContext& context) {
  absl::StatusOr<DecodedSurface> decoded = DecodeDss(bytes, context);
  RILIEVO_RETURN_IF_ERROR(StatusOfDss(path, bytes, decoded.status()));
  return decoded;
}

absl::StatusOr<OpenedDss> OpenBytes(const std::string& path, const std::vector<uint8_t>& bytes) {
  absl::StatusOr<OpenedDss> file = OpenDss(bytes, true);
  RILIEVO_RETURN_IF_ERROR(StatusOfDss(path, bytes, file.status()));
  return file;
}

absl::StatusOr<DecodedSurface> LoadDss(const std::string& path, const RunContext& context) {
  RILIEVO_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, ReadBytes(path));
  return DecodeBytes(path, bytes, context);
}

absl::StatusOr<LoadedShape> LoadShape(const std::string& path, std::optional<int> level,
                                      const RunContext& context, const std::string& format,
                                      ShownPart part) {
  return WithInput(path, [&](std::istream& in) -> absl::StatusOr<LoadedShape> {
    const std::string name = NameOf(path, format);
    HeadedInput input(in);
    RILIEVO_ASSIGN_OR_RETURN(const FileKind kind, RecognizeFile(input.head(), input.size(), name));
    if (kind == FileKind::kDss) {
      RILIEVO_ASSIGN_OR_RETURN(const DecodedSurface decoded,
                               DecodeDss(AllBytes(input.stream()), context));
      return ShapeOf(decoded, level, part, context);
    }
    if (part != ShownPart::kSurface) {
      return WithExitCode(
          absl::InvalidArgumentError("only a .dss surface has a domain and a control mesh; leave "
                                     "--show out"),
          ExitCode::kUsage);
    }
    if (level) {
      return WithExitCode(
          absl::InvalidArgumentError("only a .dss surface has levels; leave --level out"),
          ExitCode::kUsage);
    }
    RILIEVO_ASSIGN_OR_RETURN(MeshFile file, ReadMeshStream(input.stream(), name));
    return ShapeOf(std::move(file));
  });
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

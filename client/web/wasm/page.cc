#include "client/web/wasm/page.h"

#include <Eigen/Core>
#include <algorithm>
#include <istream>
#include <memory>
#include <sstream>
#include <streambuf>
#include <string>
#include <utility>
#include <vector>

#include "absl/strings/str_cat.h"
#include "client/decoder_c/guarded.h"
#include "client/decoder_c/surface.h"
#include "client/formats/carried_layers.h"
#include "client/formats/glb_writer.h"
#include "client/formats/mesh_writer.h"
#include "client/formats/scan_reader.h"
#include "core/base/sha256.h"
#include "core/base/status_macros.h"
#include "core/geometry/point_records.h"
#include "core/surface/error_at_vertices.h"

struct RilievoScan {
  rilievo::ScanFile file;
  std::string place;  // JSON
  std::string packed;
};

struct RilievoBytes {
  std::string bytes;
};

namespace rilievo {
namespace {

using decoder_c::Elements;
using decoder_c::Guarded;

// Bytes of the caller as a stream that can be sought in.
class MemoryBuffer : public std::streambuf {
 public:
  MemoryBuffer(const char* bytes, size_t size) {
    char* begin = const_cast<char*>(bytes);  // read only, whatever streambuf's types say
    setg(begin, begin, begin + size);
  }

 protected:
  pos_type seekoff(off_type offset, std::ios_base::seekdir from, std::ios_base::openmode) override {
    const char* base = from == std::ios_base::beg   ? eback()
                       : from == std::ios_base::cur ? gptr()
                                                    : egptr();
    const off_type position = base - eback() + offset;
    if (position < 0 || position > egptr() - eback()) return pos_type(off_type(-1));
    setg(eback(), eback() + position, egptr());
    return pos_type(position);
  }
  pos_type seekpos(pos_type position, std::ios_base::openmode which) override {
    return seekoff(off_type(position), std::ios_base::beg, which);
  }
};

TriangleMesh MeshOf(const RilievoMesh* mesh) {
  size_t numbers = 0, corners = 0, components = 0;
  const double* vertices = rilievo_mesh_vertices(mesh, &numbers);
  const uint32_t* faces = rilievo_mesh_faces(mesh, &corners);
  const float* normals = rilievo_mesh_normals(mesh, &components);
  TriangleMesh result;
  result.vertices = Eigen::Map<const Eigen::Matrix3Xd>(vertices, 3, numbers / 3);
  result.triangles =
      Eigen::Map<const Eigen::Matrix<uint32_t, 3, Eigen::Dynamic>>(faces, 3, corners / 3)
          .cast<int>();
  result.normals = Eigen::Map<const Eigen::Matrix3Xf>(normals, 3, components / 3).cast<double>();
  return result;
}

absl::Status MeasureDistance(const Eigen::Matrix3Xd& points, const TriangleMesh& mesh,
                             float* distances, double* rms) {
  RILIEVO_ASSIGN_OR_RETURN(const VertexErrors errors, ErrorAtVertices(mesh, points, RunContext()));
  std::copy(errors.at_vertex.begin(), errors.at_vertex.end(), distances);
  if (rms != nullptr) *rms = errors.rms;
  return absl::OkStatus();
}

// `write`: one of the writers of meshes with flags.
template <typename Write>
absl::Status WriteInto(const Write& write, const RilievoMesh* mesh, const RilievoScan* carried,
                       RilievoBytes** bytes) {
  *bytes = nullptr;
  size_t count = 0;
  const uint8_t* flags = rilievo_mesh_flags(mesh, &count);
  std::vector<HeightSource> sources(count);
  std::transform(flags, flags + count, sources.begin(),
                 [](uint8_t flag) { return static_cast<HeightSource>(flag); });
  const TriangleMesh triangles = MeshOf(mesh);
  PointLayers layers;
  const uint8_t* colors = rilievo_mesh_colors(mesh, &count);
  for (size_t i = 0; i < count; i += 3) {
    layers.colors.push_back({colors[i], colors[i + 1], colors[i + 2]});
  }
  if (carried != nullptr) {
    RILIEVO_ASSIGN_OR_RETURN(PointLayers near,
                             LayersAt(triangles.vertices, carried->file, RunContext()));
    if (near.colors.empty()) near.colors = std::move(layers.colors);
    layers = std::move(near);
  }
  std::ostringstream out;
  RILIEVO_RETURN_IF_ERROR(write(triangles, sources, out, layers));
  *bytes = new RilievoBytes{.bytes = std::move(out).str()};
  return absl::OkStatus();
}

}  // namespace
}  // namespace rilievo

using rilievo::Guarded;

RilievoCode rilievo_page_read_scan(const char* bytes, size_t size, const char* name,
                                   RilievoScan** scan) {
  return Guarded([&]() -> absl::Status {
    *scan = nullptr;
    rilievo::MemoryBuffer buffer(bytes, size);
    std::istream in(&buffer);
    RILIEVO_ASSIGN_OR_RETURN(
        rilievo::ScanFile file,
        rilievo::ReadScanStream(
            in, name, {.intensity = true, .colors = true, .stations = true, .normals = true}));
    // The page says what it read; that its faces play no part must be said too.
    if (file.faces > 0) absl::StrAppend(&file.format, " without its faces (", file.faces, ")");
    std::string place = rilievo::decoder_c::PlaceJson(file.place);
    *scan = new RilievoScan{.file = std::move(file), .place = std::move(place), .packed = {}};
    return absl::OkStatus();
  });
}

void rilievo_page_scan_free(RilievoScan* scan) { delete scan; }

const double* rilievo_page_scan_points(const RilievoScan* scan, size_t* count) {
  return rilievo::Elements(scan->file.cloud.points, count);
}

const char* rilievo_page_scan_place(const RilievoScan* scan) { return scan->place.c_str(); }

const char* rilievo_page_scan_format(const RilievoScan* scan) { return scan->file.format.c_str(); }

const uint8_t* rilievo_page_scan_packed(RilievoScan* scan, int* coordinate_bytes, uint8_t* sha256,
                                        size_t* count) {
  const rilievo::PointCloud& cloud = scan->file.cloud;
  const rilievo::PointLayout layout = rilievo::LosslessLayout(cloud);
  scan->packed = rilievo::PackPoints(cloud, 0, cloud.points.cols(), layout);
  *coordinate_bytes = layout.coordinates == rilievo::CoordinateType::kFloat32 ? 4 : 8;
  *count = scan->packed.size();
  const auto* bytes = reinterpret_cast<const uint8_t*>(scan->packed.data());
  rilievo_page_sha256(bytes, *count, sha256);
  return bytes;
}

const double* rilievo_page_scan_stations(const RilievoScan* scan, size_t* count) {
  return rilievo::Elements(scan->file.cloud.sights.stations, count);
}

int rilievo_page_scan_has_normals(const RilievoScan* scan) {
  return scan->file.cloud.sights.normals.cols() != 0 ? 1 : 0;
}

void rilievo_page_sha256(const uint8_t* bytes, size_t size, uint8_t* digest) {
  rilievo::Sha256 hash;
  hash.Add({bytes, size});
  const auto finished = hash.Finish();
  std::copy(finished.begin(), finished.end(), digest);
}

RilievoCode rilievo_page_scan_distance(const RilievoScan* scan, const RilievoMesh* mesh,
                                       float* distances, double* rms) {
  return Guarded([&] {
    return rilievo::MeasureDistance(scan->file.cloud.points, rilievo::MeshOf(mesh), distances, rms);
  });
}

int rilievo_page_scan_layers(const RilievoScan* scan) {
  return (scan->file.cloud.sights.colors.empty() ? 0 : 1) |
         (scan->file.layers.intensity.empty() ? 0 : 2);
}

RilievoCode rilievo_page_scan_colors(const RilievoScan* scan, const RilievoMesh* mesh,
                                     RilievoBytes** bytes) {
  return Guarded([&]() -> absl::Status {
    *bytes = nullptr;
    RILIEVO_ASSIGN_OR_RETURN(
        const rilievo::PointLayers layers,
        rilievo::LayersAt(rilievo::MeshOf(mesh).vertices, scan->file, rilievo::RunContext()));
    auto colors = std::make_unique<RilievoBytes>();
    for (const auto& color : layers.colors) colors->bytes.append(color.begin(), color.end());
    *bytes = colors.release();
    return absl::OkStatus();
  });
}

RilievoCode rilievo_page_write_ply(const RilievoMesh* mesh, const RilievoScan* carried,
                                   RilievoBytes** bytes) {
  return Guarded([&] { return rilievo::WriteInto(rilievo::WritePlyMesh, mesh, carried, bytes); });
}

RilievoCode rilievo_page_write_glb(const RilievoSurface* surface, const RilievoMesh* mesh,
                                   const RilievoScan* carried, RilievoBytes** bytes) {
  const auto write = [&](const auto& triangles, const auto& sources, std::ostream& out,
                         const auto& layers) {
    return rilievo::WriteGlbMesh(triangles, sources, out, layers, surface->decoded.metadata.place);
  };
  return Guarded([&] { return rilievo::WriteInto(write, mesh, carried, bytes); });
}

const uint8_t* rilievo_page_bytes(const RilievoBytes* bytes, size_t* count) {
  *count = bytes->bytes.size();
  return reinterpret_cast<const uint8_t*>(bytes->bytes.data());
}

void rilievo_page_bytes_free(RilievoBytes* bytes) { delete bytes; }

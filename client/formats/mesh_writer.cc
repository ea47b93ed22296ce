#include "client/formats/mesh_writer.h"

#include <Eigen/Geometry>
#include <cstdint>
#include <string>

#include "absl/strings/str_cat.h"
#include "client/formats/atomic_file.h"
#include "client/formats/block_writer.h"
#include "client/formats/file_kind.h"
#include "client/formats/glb_writer.h"
#include "client/formats/number_text.h"
#include "client/formats/threemf/threemf_writer.h"
#include "core/base/status_macros.h"

namespace rilievo {
namespace {

bool HasNormals(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& normals) {
  return normals.cols() == points.cols() && points.cols() > 0;
}

// Whether rounding to float moves no coordinate by more than 1e-6 of the diagonal.
bool FloatKeeps(const Eigen::Matrix3Xd& points) {
  if (points.cols() == 0) return true;
  const Eigen::Vector3d size = points.rowwise().maxCoeff() - points.rowwise().minCoeff();
  const double largest = points.cwiseAbs().maxCoeff();
  return largest < 3e38 && largest * 0x1.0p-24 <= 1e-6 * size.norm();
}

void WriteCoordinates(const Eigen::Vector3d& p, bool as_float, BlockWriter* writer) {
  for (int axis = 0; axis < 3; ++axis) {
    if (as_float) {
      writer->Little(static_cast<float>(p(axis)));
    } else {
      writer->Little(p(axis));
    }
  }
}

struct PlyColumns {
  const Eigen::Matrix3Xd& points;
  const Eigen::Matrix3Xd& normals;
  std::span<const HeightSource> sources;
  const PointLayers& layers;
  bool float_points;
};

std::string PlyVertexHeader(const PlyColumns& columns) {
  const char* type = columns.float_points ? "float" : "double";
  std::string header = absl::StrCat("ply\nformat binary_little_endian 1.0\nelement vertex ",
                                    columns.points.cols(), "\n");
  for (const char* name : {"x", "y", "z"})
    absl::StrAppend(&header, "property ", type, " ", name, "\n");
  if (HasNormals(columns.points, columns.normals)) {
    header += "property float nx\nproperty float ny\nproperty float nz\n";
  }
  if (!columns.sources.empty()) header += "property uchar source\n";
  if (!columns.layers.colors.empty()) {
    header += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
  }
  if (!columns.layers.intensity.empty()) header += "property float intensity\n";
  return header;
}

void WritePlyVertices(const PlyColumns& columns, BlockWriter* writer) {
  const bool normals = HasNormals(columns.points, columns.normals);
  for (Eigen::Index i = 0; i < columns.points.cols(); ++i) {
    WriteCoordinates(columns.points.col(i), columns.float_points, writer);
    if (normals) WriteCoordinates(columns.normals.col(i), true, writer);
    if (!columns.sources.empty()) {
      writer->Little(static_cast<uint8_t>(columns.sources[static_cast<size_t>(i)]));
    }
    if (!columns.layers.colors.empty()) {
      for (const uint8_t channel : columns.layers.colors[static_cast<size_t>(i)]) {
        writer->Little(channel);
      }
    }
    if (!columns.layers.intensity.empty()) {
      writer->Little(columns.layers.intensity[static_cast<size_t>(i)]);
    }
  }
}

Eigen::Vector3d FaceNormal(const TriangleMesh& mesh, Eigen::Index face) {
  const Eigen::Vector3d a = mesh.vertices.col(mesh.triangles(0, face));
  const Eigen::Vector3d b = mesh.vertices.col(mesh.triangles(1, face));
  const Eigen::Vector3d c = mesh.vertices.col(mesh.triangles(2, face));
  const Eigen::Vector3d cross = (b - a).cross(c - a);
  const double norm = cross.norm();
  return norm > 0 ? Eigen::Vector3d(cross / norm) : Eigen::Vector3d(Eigen::Vector3d::Zero());
}

}  // namespace

absl::Status WritePlyMesh(const TriangleMesh& mesh, std::span<const HeightSource> sources,
                          std::ostream& out, const PointLayers& layers) {
  if (!sources.empty() && static_cast<Eigen::Index>(sources.size()) != mesh.vertices.cols()) {
    return absl::InvalidArgumentError(
        absl::StrCat(sources.size(), " height sources for ", mesh.vertices.cols(), " vertices"));
  }
  RILIEVO_RETURN_IF_ERROR(CheckLayers(layers, mesh.vertices.cols()));
  const PlyColumns columns{mesh.vertices, mesh.normals, sources, layers, FloatKeeps(mesh.vertices)};
  BlockWriter writer(out);
  absl::StrAppend(&writer.text(), PlyVertexHeader(columns), "element face ", mesh.triangles.cols(),
                  "\nproperty list uchar int vertex_indices\nend_header\n");
  WritePlyVertices(columns, &writer);
  for (Eigen::Index face = 0; face < mesh.triangles.cols(); ++face) {
    writer.Little(uint8_t{3});
    for (int corner = 0; corner < 3; ++corner) writer.Little(mesh.triangles(corner, face));
  }
  return absl::OkStatus();
}

absl::Status WritePlyPoints(const Eigen::Matrix3Xd& points, const Eigen::Matrix3Xd& normals,
                            std::ostream& out) {
  const PointLayers none;
  const PlyColumns columns{points, normals, {}, none, false};
  BlockWriter writer(out);
  absl::StrAppend(&writer.text(), PlyVertexHeader(columns), "end_header\n");
  WritePlyVertices(columns, &writer);
  return absl::OkStatus();
}

absl::Status WriteObjMesh(const TriangleMesh& mesh, std::ostream& out, const PointLayers& layers) {
  RILIEVO_RETURN_IF_ERROR(CheckLayers(layers, mesh.vertices.cols()));
  const bool normals = HasNormals(mesh.vertices, mesh.normals);
  BlockWriter writer(out);
  const auto write_rows = [&](const char* keyword, const Eigen::Matrix3Xd& rows, bool as_float,
                              std::span<const Rgb> colors) {
    for (Eigen::Index i = 0; i < rows.cols(); ++i) {
      std::string& text = writer.text();
      text += keyword;
      for (int axis = 0; axis < 3; ++axis) {
        text += ' ';
        if (as_float) {
          AppendNumber(static_cast<float>(rows(axis, i)), &text);
        } else {
          AppendNumber(rows(axis, i), &text);
        }
      }
      for (size_t channel = 0; channel < 3 && !colors.empty(); ++channel) {
        text += ' ';
        AppendNumber(static_cast<float>(colors[static_cast<size_t>(i)][channel]) / 255, &text);
      }
      text += '\n';
    }
  };
  write_rows("v", mesh.vertices, false, layers.colors);
  if (normals) write_rows("vn", mesh.normals, true, {});
  for (Eigen::Index face = 0; face < mesh.triangles.cols(); ++face) {
    std::string& text = writer.text();
    text += 'f';
    for (int corner = 0; corner < 3; ++corner) {
      const int64_t index = int64_t{mesh.triangles(corner, face)} + 1;
      text += ' ';
      AppendNumber(index, &text);
      if (!normals) continue;
      text += "//";
      AppendNumber(index, &text);
    }
    text += '\n';
  }
  return absl::OkStatus();
}

absl::Status WriteObjPolygons(const PolygonMesh& mesh, std::ostream& out) {
  RILIEVO_RETURN_IF_ERROR(WriteObjMesh({mesh.vertices, {}, {}}, out));
  BlockWriter writer(out);
  for (int f = 0; f < mesh.face_count(); ++f) {
    std::string& text = writer.text();
    text += 'f';
    for (const int corner : mesh.Face(f)) {
      text += ' ';
      AppendNumber(int64_t{corner} + 1, &text);
    }
    text += '\n';
  }
  return absl::OkStatus();
}

absl::Status WriteStlMesh(const TriangleMesh& mesh, std::ostream& out) {
  if (mesh.triangles.cols() > static_cast<Eigen::Index>(UINT32_MAX)) {
    return absl::InvalidArgumentError("STL holds at most 2^32 - 1 triangles");
  }
  BlockWriter writer(out);
  std::string header = "rilievo";
  header.resize(80, ' ');
  writer.text() += header;
  writer.Little(static_cast<uint32_t>(mesh.triangles.cols()));
  for (Eigen::Index face = 0; face < mesh.triangles.cols(); ++face) {
    WriteCoordinates(FaceNormal(mesh, face), true, &writer);
    for (int corner = 0; corner < 3; ++corner) {
      WriteCoordinates(mesh.vertices.col(mesh.triangles(corner, face)), true, &writer);
    }
    writer.Little(uint16_t{0});
  }
  return absl::OkStatus();
}

double FloatRounding(const Eigen::Matrix3Xd& points) {
  if (points.cols() == 0) return 0;
  return (points - points.cast<float>().cast<double>()).colwise().norm().maxCoeff();
}

absl::Status CheckMeshExtension(const std::string& path, const std::string& extension) {
  for (const char* known : {"ply", "obj", "stl", "glb", "3mf"}) {
    if (extension == known) return absl::OkStatus();
  }
  return absl::InvalidArgumentError(
      absl::StrCat(path, ": the extension must be .ply, .obj, .stl, .glb or .3mf"));
}

absl::Status WriteMesh(const std::string& path, const TriangleMesh& mesh,
                       std::span<const HeightSource> sources, const PointLayers& layers,
                       const ScanPlace& place) {
  return WriteMesh(path, Extension(path), mesh, sources, layers, place);
}

absl::Status WriteMesh(const std::string& path, const std::string& extension,
                       const TriangleMesh& mesh, std::span<const HeightSource> sources,
                       const PointLayers& layers, const ScanPlace& place) {
  RILIEVO_RETURN_IF_ERROR(CheckMeshExtension(path, extension));
  return WriteFileAtomically(path, [&](std::ostream& out) {
    if (extension == "obj") return WriteObjMesh(mesh, out, layers);
    if (extension == "stl") return WriteStlMesh(mesh, out);
    if (extension == "3mf") return Write3mfMesh(mesh, out, layers, place);
    if (extension == "glb") return WriteGlbMesh(mesh, sources, out, layers, place);
    return WritePlyMesh(mesh, sources, out, layers);
  });
}

}  // namespace rilievo

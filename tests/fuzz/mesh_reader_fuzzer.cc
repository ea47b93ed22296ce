// Any bytes as a mesh of one format; READER is the function that takes them.
#include <cstdint>
#include <sstream>
#include <string>

#include "client/formats/mesh_reader.h"
#include "tests/fuzz/require.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  std::istringstream in(std::string(reinterpret_cast<const char*>(data), size));
  const auto file = rilievo::READER(in);
  if (!file.ok()) {
    rilievo::Require(!file.status().message().empty());
    return 0;
  }
  const rilievo::TriangleMesh& mesh = file->mesh;
  rilievo::Require(mesh.normals.cols() == 0 || mesh.normals.cols() == mesh.vertices.cols());
  rilievo::Require(file->source.empty() ||
                   static_cast<int64_t>(file->source.size()) == mesh.vertices.cols());
  rilievo::Require(file->colors.empty() ||
                   static_cast<int64_t>(file->colors.size()) == mesh.vertices.cols());
  if (mesh.triangles.cols() > 0) {
    rilievo::Require(mesh.triangles.minCoeff() >= 0);
    rilievo::Require(mesh.triangles.maxCoeff() < mesh.vertices.cols());
  }
  return 0;
}

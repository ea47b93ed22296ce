// What the decoder makes of a file, as raw bytes, for comparison with other builds of it:
//   dump_surface IN.dss BYTES LEVEL > OUT
// decodes the first BYTES and writes the vertices (f64), faces (u32), normals (f32), flags (u8) and
// colours (u8) of LEVEL, then the heights (f32) of the finest level.
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <vector>

#include "client/decoder_c/rilievo_decoder.h"

namespace {

template <typename T>
void Write(const T* data, size_t count) {
  if (count > 0) std::fwrite(data, sizeof(T), count, stdout);
}

int Fail() {
  std::fprintf(stderr, "%s\n", rilievo_last_error());
  return 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fputs("usage: dump_surface IN.dss BYTES LEVEL > OUT\n", stderr);
    return 2;
  }
  std::ifstream in(argv[1], std::ios::binary);
  std::vector<uint8_t> bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  bytes.resize(std::min(bytes.size(), static_cast<size_t>(std::atoll(argv[2]))));
  RilievoSurface* surface = nullptr;
  if (rilievo_decode(bytes.data(), bytes.size(), 0, &surface) != RILIEVO_OK) return Fail();
  RilievoMesh* mesh = nullptr;
  if (rilievo_tessellate(surface, std::atoi(argv[3]), 0, &mesh) != RILIEVO_OK) return Fail();
  size_t count = 0;
  const double* vertices = rilievo_mesh_vertices(mesh, &count);
  Write(vertices, count);
  const uint32_t* faces = rilievo_mesh_faces(mesh, &count);
  Write(faces, count);
  const float* normals = rilievo_mesh_normals(mesh, &count);
  Write(normals, count);
  const uint8_t* flags = rilievo_mesh_flags(mesh, &count);
  Write(flags, count);
  const uint8_t* colors = rilievo_mesh_colors(mesh, &count);
  Write(colors, count);
  const float* heights = rilievo_surface_heights(surface, &count);
  Write(heights, count);
  rilievo_mesh_free(mesh);
  rilievo_surface_free(surface);
  return 0;
}

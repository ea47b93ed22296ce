// A program of the decoder alone: reads a .dss, writes the triangles of a level as OBJ. Built so
// that its libraries can be looked at.
#include <cstdlib>
#include <fstream>
#include <iostream>
#include <iterator>
#include <vector>

#include "core/codec/container/dss.h"

int main(int argc, char** argv) {
  if (argc < 2) {
    std::cerr << "usage: decode_only IN.dss [LEVEL] > OUT.obj\n";
    return 2;
  }
  std::ifstream in(argv[1], std::ios::binary);
  const std::vector<uint8_t> bytes{std::istreambuf_iterator<char>(in),
                                   std::istreambuf_iterator<char>()};
  const auto decoded = rilievo::DecodeDss(bytes, rilievo::RunContext());
  if (!decoded.ok()) {
    std::cerr << decoded.status() << '\n';
    return 1;
  }
  const int level = argc > 2 ? std::atoi(argv[2]) : decoded->surface.max_level;
  const auto mesh = rilievo::Tessellate(decoded->surface, level, rilievo::RunContext());
  if (!mesh.ok()) {
    std::cerr << mesh.status() << '\n';
    return 1;
  }
  std::cout.precision(9);
  for (const auto vertex : mesh->vertices.colwise())
    std::cout << "v " << vertex.transpose() << '\n';
  for (const auto face : mesh->triangles.colwise()) {
    std::cout << "f " << face.transpose().array() + 1 << '\n';
  }
  return 0;
}

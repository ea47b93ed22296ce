// Whether the borders between groups show in a .dss file, as one line of JSON.
//
//   rilievo_seams FILE.dss
//
// angle, bend: those of the finest edges between groups over those of the edges between control
// faces of one group, see seams.h.
#include <cstdio>
#include <fstream>
#include <iterator>
#include <vector>

#include "tests/benchmark/seams.h"

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: rilievo_seams FILE.dss\n");
    return 2;
  }
  std::ifstream file(argv[1], std::ios::binary);
  const std::vector<char> read{std::istreambuf_iterator<char>(file), {}};
  const std::vector<uint8_t> bytes(read.begin(), read.end());
  const auto seams = rilievo::MeasureSeams(bytes, rilievo::RunContext());
  if (!seams.ok()) {
    std::fprintf(stderr, "rilievo_seams: %s: %s\n", argv[1],
                 std::string(seams.status().message()).c_str());
    return 1;
  }
  std::printf("{\"borders\": %lld, \"angle\": %.4f, \"bend\": %.4f}\n",
              static_cast<long long>(seams->border.control_edges), seams->AngleRatio(),
              seams->BendRatio());
  return 0;
}

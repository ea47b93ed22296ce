// Points of a torus become a surface, a file, and a mesh again.
#include <rilievo/core/pipeline/reconstruct.h>

#include <cmath>
#include <iostream>

int main() {
  constexpr int kPoints = 8000;
  rilievo::PointCloud scan{Eigen::Matrix3Xd(3, kPoints)};
  for (int i = 0; i < kPoints; ++i) {
    const double u = 2 * M_PI * i / kPoints, v = 2 * M_PI * std::fmod(i * 0.6180339887, 1.0);
    const double ring = 1 + 0.4 * std::cos(v);
    scan.points.col(i) << ring * std::cos(u), ring * std::sin(u), 0.4 * std::sin(v);
  }
  const auto made = rilievo::Reconstruct(scan, {}, {});
  if (!made.ok()) {
    std::cerr << made.status() << '\n';
    return 1;
  }
  const std::vector<uint8_t> file = made->encoded.Concatenate();
  const auto decoded = rilievo::DecodeDss(file, {});
  const auto mesh = rilievo::Tessellate(decoded->surface, decoded->surface.max_level, {});
  std::cout << "genus " << made->report.genus << ", " << file.size() << " bytes, "
            << mesh->triangles.cols() << " triangles, RMS "
            << made->report.error.rms * made->report.diagonal << '\n';
}

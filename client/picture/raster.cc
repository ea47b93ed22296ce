#include "client/picture/raster.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace rilievo {
namespace {

using Eigen::Vector3f;

// Light directions in view axes: a key light over the left shoulder, weights of the three parts.
const Vector3f kKeyLight = Vector3f(-0.45f, 0.55f, 0.70f).normalized();
constexpr float kKey = 0.62f, kHead = 0.22f, kAmbient = 0.14f, kGloss = 0.10f, kGlossPower = 24.f;
const Vector3f kBackColor(0.62f, 0.12f, 0.07f);

uint8_t SrgbByte(float linear) {
  const float c = std::clamp(linear, 0.f, 1.f);
  const float encoded = c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
  return static_cast<uint8_t>(std::lround(255 * encoded));
}

// Linear light in 4096 steps to sRGB.
const std::array<uint8_t, 4097>& SrgbTable() {
  static const std::array<uint8_t, 4097> table = [] {
    std::array<uint8_t, 4097> t;
    for (size_t i = 0; i < t.size(); ++i) t[i] = SrgbByte(static_cast<float>(i) / 4096);
    return t;
  }();
  return table;
}

}  // namespace

float SignedDoubleArea(const Projected& a, const Projected& b, const Projected& c) {
  // Rows count downward, hence the sign.
  return (b.y - a.y) * (c.x - a.x) - (b.x - a.x) * (c.y - a.y);
}

Vector3f Shade(const Vector3f& color, const Vector3f& normal, const Vector3f& towards) {
  const float key = std::max(0.f, normal.dot(kKeyLight));
  const float head = std::max(0.f, normal.dot(towards));
  const float sky = 0.75f + 0.25f * normal.y();
  const Vector3f half = (kKeyLight + towards).normalized();
  const float gloss = std::pow(std::max(0.f, normal.dot(half)), kGlossPower);
  return color * (kKey * key + kHead * head + kAmbient * sky) +
         Vector3f::Constant(kGloss * gloss * (key > 0 ? 1.f : 0.f));
}

void DrawTriangle(const RasterCorner corners[3], const Vector3f& towards, bool back, int row_begin,
                  int row_end, Raster* raster) {
  const Projected &a = corners[0].at, &b = corners[1].at, &c = corners[2].at;
  const float area = SignedDoubleArea(a, b, c);
  if (area == 0 || !std::isfinite(area)) return;
  // Samples sit at pixel centres (x + 0.5, y + 0.5).
  const auto first = [](float low) { return static_cast<int>(std::ceil(low - 0.5f)); };
  const auto last = [](float high) { return static_cast<int>(std::floor(high - 0.5f)); };
  const int y_begin = std::max(row_begin, first(std::min({a.y, b.y, c.y})));
  const int y_end = std::min(row_end - 1, last(std::max({a.y, b.y, c.y})));
  const int x_begin = std::max(0, first(std::min({a.x, b.x, c.x})));
  const int x_end = std::min(raster->width - 1, last(std::max({a.x, b.x, c.x})));
  for (int y = y_begin; y <= y_end; ++y) {
    for (int x = x_begin; x <= x_end; ++x) {
      const Projected sample{static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f, 0};
      const float wa = SignedDoubleArea(sample, b, c) / area;
      const float wb = SignedDoubleArea(sample, c, a) / area;
      const float wc = 1 - wa - wb;
      if (wa < 0 || wb < 0 || wc < 0) continue;
      const float nearness = wa * a.nearness + wb * b.nearness + wc * c.nearness;
      const size_t at = raster->at(x, y);
      if (nearness <= raster->nearness[at]) continue;
      Vector3f normal = wa * corners[0].normal + wb * corners[1].normal + wc * corners[2].normal;
      const float norm = normal.norm();
      normal = norm > 0 ? Vector3f(normal / norm) : towards;
      // A smooth normal may lean past the silhouette; what is seen faces the camera.
      if (normal.dot(towards) < 0) normal = -normal;
      const Vector3f color =
          back ? kBackColor
               : Vector3f(wa * corners[0].color + wb * corners[1].color + wc * corners[2].color);
      raster->nearness[at] = nearness;
      raster->color[at] = Shade(color, normal, towards);
    }
  }
}

void DrawDisc(const Projected& center, float radius, const Vector3f& color, int row_begin,
              int row_end, Raster* raster) {
  if (!std::isfinite(center.x) || !std::isfinite(center.y)) return;
  const auto clamp_row = [&](float y) { return std::clamp(y, -1e6f, 1e6f); };
  const int y_begin =
      std::max(row_begin, static_cast<int>(std::floor(clamp_row(center.y - radius))));
  const int y_end =
      std::min(row_end - 1, static_cast<int>(std::ceil(clamp_row(center.y + radius))));
  const int x_begin = std::max(0, static_cast<int>(std::floor(clamp_row(center.x - radius))));
  const int x_end =
      std::min(raster->width - 1, static_cast<int>(std::ceil(clamp_row(center.x + radius))));
  for (int y = y_begin; y <= y_end; ++y) {
    for (int x = x_begin; x <= x_end; ++x) {
      const float dx = static_cast<float>(x) + 0.5f - center.x;
      const float dy = static_cast<float>(y) + 0.5f - center.y;
      if (dx * dx + dy * dy > radius * radius) continue;
      const size_t at = raster->at(x, y);
      if (center.nearness <= raster->nearness[at]) continue;
      raster->nearness[at] = center.nearness;
      raster->color[at] = color;
    }
  }
}

Image Downsample(const Raster& raster) {
  Image image{raster.width / 2, raster.height / 2, {}};
  image.rgb.resize(3 * static_cast<size_t>(image.width) * image.height);
  const std::array<uint8_t, 4097>& srgb = SrgbTable();
  size_t out = 0;
  for (int y = 0; y < image.height; ++y) {
    for (int x = 0; x < image.width; ++x) {
      const size_t at = raster.at(2 * x, 2 * y), below = at + static_cast<size_t>(raster.width);
      const Vector3f mean = 0.25f * (raster.color[at] + raster.color[at + 1] + raster.color[below] +
                                     raster.color[below + 1]);
      for (int channel = 0; channel < 3; ++channel) {
        const float linear = std::clamp(mean(channel), 0.f, 1.f);
        image.rgb[out++] = srgb[static_cast<size_t>(std::lround(4096 * linear))];
      }
    }
  }
  return image;
}

}  // namespace rilievo

#include "core/displacement/rays/virtual_triangle.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

namespace rilievo {
namespace {

// Least cosine between a triangle and the mean normal of its corners; and between it and the ray.
constexpr float kLeastCornerAgreement = 0.4f;
constexpr float kLeastRayAgreement = 0.1f;
// Twice the area across the ray below this share of the squared longest edge: a sliver.
constexpr float kLeastAreaRatio = 1e-4f;

Eigen::Vector3f InRayFrame(const QueuedPoint& point) { return {point.u, point.v, point.height}; }

float Cross(const QueuedPoint& a, const QueuedPoint& b) { return a.u * b.v - a.v * b.u; }

// Whether the triangle is flat enough against the ray and agrees with its corners' normals.
bool AgreesWithCorners(const Eigen::Vector3f& normal, float double_area, const Ray& ray,
                       const RayPoint& a, const RayPoint& b, const RayPoint& c) {
  if (normal[2] < kLeastRayAgreement * double_area) return false;
  Eigen::Vector3f mean = Eigen::Vector3f::Zero();
  for (const RayPoint* point : {&a, &b, &c})
    mean += Eigen::Map<const Eigen::Vector3f>(point->normal);
  const Eigen::Vector3f in_frame(mean.dot(ray.u), mean.dot(ray.v), mean.dot(ray.direction));
  return normal.dot(in_frame) >= kLeastCornerAgreement * double_area * in_frame.norm();
}

// The triangle of three queued points around the ray, unless a guard refuses it. wa, wb, wc: twice
// the signed areas across the ray opposite to each corner, all of one sign.
std::optional<VirtualTriangle> Accept(std::span<const QueuedPoint> queue, const RayCloud& cloud,
                                      const Ray& ray, const TriangleRules& rules, int a, int b,
                                      int c, float wa, float wb, float wc) {
  const Eigen::Vector3f flat(1, 1, rules.noisy ? 0 : 1);
  const Eigen::Vector3f pa = InRayFrame(queue[a]).cwiseProduct(flat);
  const Eigen::Vector3f ab = InRayFrame(queue[b]).cwiseProduct(flat) - pa;
  const Eigen::Vector3f ac = InRayFrame(queue[c]).cwiseProduct(flat) - pa;
  const float longest = std::max({ab.squaredNorm(), ac.squaredNorm(), (ab - ac).squaredNorm()});
  const float sum = wa + wb + wc;
  if (std::abs(sum) <= kLeastAreaRatio * longest) return std::nullopt;
  const RayPoint& ra = cloud.points[queue[a].point];
  const RayPoint& rb = cloud.points[queue[b].point];
  const RayPoint& rc = cloud.points[queue[c].point];
  const float reach = rules.max_spacings * (std::max({ra.spacing, rb.spacing, rc.spacing}) +
                                            std::max({ra.noise, rb.noise, rc.noise}));
  if (longest > reach * reach) return std::nullopt;
  Eigen::Vector3f normal = ab.cross(ac);
  if (normal[2] < 0) normal = -normal;
  const float double_area = normal.norm();
  if (!rules.noisy && !AgreesWithCorners(normal, double_area, ray, ra, rb, rc)) {
    return std::nullopt;
  }
  VirtualTriangle triangle = {{a, b, c}, {wa / sum, wb / sum, wc / sum}, 0, 0.5f * double_area};
  triangle.height = triangle.barycentric[0] * queue[a].height +
                    triangle.barycentric[1] * queue[b].height +
                    triangle.barycentric[2] * queue[c].height;
  return triangle;
}

}  // namespace

std::optional<VirtualTriangle> FindVirtualTriangle(std::span<const QueuedPoint> queue,
                                                   const RayCloud& cloud, const Ray& ray,
                                                   const TriangleRules& rules) {
  const int count = std::min(static_cast<int>(queue.size()), kMostTriangleCorners);
  std::array<float, kMostTriangleCorners> with_newest;
  for (int c = 2; c < count; ++c) {
    for (int a = 0; a < c; ++a) with_newest[a] = Cross(queue[c], queue[a]);
    std::optional<VirtualTriangle> best;
    float best_cost = 0;
    for (int b = 1; b < c; ++b) {
      const float wa = -with_newest[b];  // queue[b] x queue[c]
      for (int a = 0; a < b; ++a) {
        const float wb = with_newest[a];  // queue[c] x queue[a]
        if (wa * wb < 0) continue;
        const float wc = Cross(queue[a], queue[b]);
        if (wa * wc < 0 || wb * wc < 0) continue;
        const auto triangle = Accept(queue, cloud, ray, rules, a, b, c, wa, wb, wc);
        if (!triangle) continue;
        const float off = (triangle->height - rules.reference_height) /
                          (2.0f * cloud.points[queue[a].point].spacing);
        const float cost = triangle->area * (1.0f + off * off);
        if (!best || cost < best_cost) {
          best = triangle;
          best_cost = cost;
        }
      }
    }
    if (best) return best;
  }
  return std::nullopt;
}

}  // namespace rilievo

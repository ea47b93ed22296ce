// Control meshes and oriented clouds of shapes known in closed form, for the tests of the fit.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <numbers>
#include <utility>
#include <vector>

#include "core/geometry/triangle_mesh.h"
#include "core/points/oriented_cloud.h"
#include "tests/scans/random.h"

namespace rilievo {

inline ControlMesh MeshOf(const std::vector<Eigen::Vector3d>& vertices,
                          const std::vector<Eigen::Vector3i>& faces) {
  ControlMesh mesh;
  mesh.vertices.resize(3, static_cast<Eigen::Index>(vertices.size()));
  mesh.faces.resize(3, static_cast<Eigen::Index>(faces.size()));
  for (size_t i = 0; i < vertices.size(); ++i) {
    mesh.vertices.col(static_cast<Eigen::Index>(i)) = vertices[i];
  }
  for (size_t i = 0; i < faces.size(); ++i) {
    mesh.faces.col(static_cast<Eigen::Index>(i)) = faces[i];
  }
  return mesh;
}

// An octahedron split `levels` times, its vertices on a sphere around the origin: 8 * 4^levels
// faces. `upper_half` keeps z >= 0: an open hemisphere.
inline ControlMesh OctahedralSphere(double radius, int levels, bool upper_half = false) {
  std::vector<Eigen::Vector3d> vertices = {{1, 0, 0}, {0, 1, 0}, {-1, 0, 0}, {0, -1, 0}, {0, 0, 1}};
  std::vector<Eigen::Vector3i> faces = {{0, 1, 4}, {1, 2, 4}, {2, 3, 4}, {3, 0, 4}};
  if (!upper_half) {
    vertices.emplace_back(0, 0, -1);
    for (int k = 0; k < 4; ++k) faces.emplace_back((k + 1) % 4, k, 5);
  }
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<int, int>, int> middles;
    const auto middle = [&](int a, int b) {
      const auto [place, added] =
          middles.try_emplace({std::min(a, b), std::max(a, b)}, static_cast<int>(vertices.size()));
      if (added) vertices.push_back((vertices[a] + vertices[b]).normalized());
      return place->second;
    };
    std::vector<Eigen::Vector3i> split;
    for (const Eigen::Vector3i& f : faces) {
      const int a = middle(f[0], f[1]), b = middle(f[1], f[2]), c = middle(f[2], f[0]);
      split.insert(split.end(), {{f[0], a, c}, {a, f[1], b}, {c, b, f[2]}, {a, b, c}});
    }
    faces = std::move(split);
  }
  for (Eigen::Vector3d& vertex : vertices) vertex *= radius;
  return MeshOf(vertices, faces);
}

// A regular triangulation of the torus around z: 2 * around * across faces.
inline ControlMesh TorusMesh(double ring, double tube, int around, int across) {
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> faces;
  for (int i = 0; i < around; ++i) {
    for (int j = 0; j < across; ++j) {
      const double u = 2 * std::numbers::pi * i / around, v = 2 * std::numbers::pi * j / across;
      const double r = ring + tube * std::cos(v);
      vertices.emplace_back(r * std::cos(u), r * std::sin(u), tube * std::sin(v));
      const auto at = [&](int a, int b) { return (i + a) % around * across + (j + b) % across; };
      faces.emplace_back(at(0, 0), at(1, 0), at(1, 1));
      faces.emplace_back(at(0, 0), at(1, 1), at(0, 1));
    }
  }
  return MeshOf(vertices, faces);
}

// The six sides of the box [-h, h], each cut into squares of about `step`, two triangles each.
inline ControlMesh BoxMesh(const Eigen::Vector3d& half, double step) {
  Eigen::Vector3i cells;
  for (int k = 0; k < 3; ++k) {
    cells[k] = std::max(1, static_cast<int>(std::lround(2 * half[k] / step)));
  }
  std::map<std::array<int, 3>, int> numbers;
  std::vector<Eigen::Vector3d> vertices;
  std::vector<Eigen::Vector3i> faces;
  const auto vertex = [&](const Eigen::Vector3i& g) {
    const auto [place, added] =
        numbers.try_emplace({g[0], g[1], g[2]}, static_cast<int>(vertices.size()));
    if (added) {
      vertices.emplace_back(half.cwiseProduct(
          (2.0 * g.cast<double>().cwiseQuotient(cells.cast<double>())).array().matrix() -
          Eigen::Vector3d::Ones()));
    }
    return place->second;
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int u = (axis + 1) % 3, v = (axis + 2) % 3;
    for (int side = 0; side < 2; ++side) {
      for (int i = 0; i < cells[u]; ++i) {
        for (int j = 0; j < cells[v]; ++j) {
          const auto at = [&](int a, int b) {
            Eigen::Vector3i g;
            g[axis] = side * cells[axis];
            g[u] = i + a;
            g[v] = j + b;
            return vertex(g);
          };
          const int p = at(0, 0), q = at(1, 0), r = at(1, 1), s = at(0, 1);
          if (side == 1) {
            faces.insert(faces.end(), {{p, q, r}, {p, r, s}});
          } else {
            faces.insert(faces.end(), {{p, r, q}, {p, s, r}});
          }
        }
      }
    }
  }
  return MeshOf(vertices, faces);
}

// BoxMesh with its twelve edges tagged, which makes corners of its eight corners.
inline ControlMesh SharpBoxMesh(const Eigen::Vector3d& half, double step) {
  ControlMesh mesh = BoxMesh(half, step);
  const auto sides_at = [&](const Eigen::Vector3d& at) {
    return ((at.cwiseAbs() - half).cwiseAbs().array() < 1e-9).count();
  };
  for (Eigen::Index f = 0; f < mesh.faces.cols(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const int a = mesh.faces(k, f), b = mesh.faces((k + 1) % 3, f);
      const Eigen::Vector3d middle = (mesh.vertices.col(a) + mesh.vertices.col(b)) / 2;
      if (a < b && sides_at(middle) == 2) mesh.creases.push_back({a, b});
    }
  }
  std::sort(mesh.creases.begin(), mesh.creases.end(), [](const Crease& p, const Crease& q) {
    return std::pair(p.a, p.b) < std::pair(q.a, q.b);
  });
  return mesh;
}

// `count` points from `sample`, which returns a point and its unit normal; `area` of the whole
// surface sets the spacing: each point's share is pi/4 spacing^2.
inline OrientedCloud CloudOf(
    int count, double area,
    const std::function<std::pair<Eigen::Vector3d, Eigen::Vector3d>()>& sample) {
  OrientedCloud cloud;
  cloud.points.resize(3, count);
  cloud.normals.resize(3, count);
  for (int i = 0; i < count; ++i) {
    const auto [point, normal] = sample();
    cloud.points.col(i) = point;
    cloud.normals.col(i) = normal;
  }
  cloud.median_spacing = std::sqrt(4 * area / (std::numbers::pi * count));
  cloud.spacing.assign(static_cast<size_t>(count), static_cast<float>(cloud.median_spacing));
  cloud.noise.assign(static_cast<size_t>(count), 0.0f);
  return cloud;
}

inline Eigen::Vector3d RandomDirection(Random* random) {
  return Eigen::Vector3d(random->Normal(), random->Normal(), random->Normal()).normalized();
}

// `noise`: standard deviation along the normal, which stays that of the sphere.
inline OrientedCloud SphereCloud(double radius, int count, double noise = 0,
                                 bool upper_half = false, uint64_t seed = 1) {
  Random random(seed);
  const double area = (upper_half ? 2 : 4) * std::numbers::pi * radius * radius;
  return CloudOf(count, area, [&] {
    Eigen::Vector3d n = RandomDirection(&random);
    if (upper_half) n.z() = std::abs(n.z());
    return std::pair<Eigen::Vector3d, Eigen::Vector3d>(n * (radius + noise * random.Normal()), n);
  });
}

inline OrientedCloud TorusCloud(double ring, double tube, int count, uint64_t seed = 1) {
  Random random(seed);
  const double area = 4 * std::numbers::pi * std::numbers::pi * ring * tube;
  return CloudOf(count, area, [&] {
    double u = 0, v = 0;
    do {
      u = random.Uniform(0, 2 * std::numbers::pi);
      v = random.Uniform(0, 2 * std::numbers::pi);
    } while (random.Uniform() > (ring + tube * std::cos(v)) / (ring + tube));
    const Eigen::Vector3d out(std::cos(u), std::sin(u), 0);
    const Eigen::Vector3d n = out * std::cos(v) + Eigen::Vector3d(0, 0, std::sin(v));
    return std::pair<Eigen::Vector3d, Eigen::Vector3d>(out * ring + n * tube, n);
  });
}

inline OrientedCloud BoxCloud(const Eigen::Vector3d& half, int count, uint64_t seed = 1) {
  Random random(seed);
  Eigen::Vector3d sides(half.y() * half.z(), half.z() * half.x(), half.x() * half.y());
  const double area = 8 * sides.sum();
  return CloudOf(count, area, [&] {
    double pick = random.Uniform() * sides.sum();
    int axis = 0;
    while (axis < 2 && pick >= sides[axis]) pick -= sides[axis++];
    Eigen::Vector3d n = Eigen::Vector3d::Zero();
    n[axis] = random.Uniform() < 0.5 ? -1 : 1;
    Eigen::Vector3d p;
    for (int k = 0; k < 3; ++k) p[k] = half[k] * random.Uniform(-1, 1);
    p[axis] = n[axis] * half[axis];
    return std::pair<Eigen::Vector3d, Eigen::Vector3d>(p, n);
  });
}

}  // namespace rilievo

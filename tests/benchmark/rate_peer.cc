// The peers' side of the rate curves: a closed-form shape as a dense mesh, and meshes simplified by
// CGAL's Lindstrom-Turk collapses, as for rd_peers.csv.
//
//   rilievo_rate_peer project SHAPE IN.off OUT.off    vertices of IN onto the simulator's shape
//   rilievo_rate_peer simplify IN.off FACES OUT.off   to at most FACES faces
#include <CGAL/Simple_cartesian.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/Surface_mesh/IO/OFF.h>
#include <CGAL/Surface_mesh_simplification/Policies/Edge_collapse/Count_stop_predicate.h>
#include <CGAL/Surface_mesh_simplification/edge_collapse.h>

#include <cstdlib>
#include <fstream>
#include <iostream>
#include <string>

#include "tests/scans/analytic_shape.h"

namespace {

using Point = CGAL::Simple_cartesian<double>::Point_3;
using Mesh = CGAL::Surface_mesh<Point>;

int Fail(const std::string& message) {
  std::cerr << "rilievo_rate_peer: " << message << "\n";
  return 1;
}

// The scan is in the shape's own frame.
void Project(const rilievo::AnalyticShape& shape, Mesh* mesh) {
  for (const auto v : mesh->vertices()) {
    const Point& p = mesh->point(v);
    const Eigen::Vector3d on = shape.ClosestPoint({p.x(), p.y(), p.z()});
    mesh->point(v) = Point(on.x(), on.y(), on.z());
  }
}

void Simplify(size_t faces, Mesh* mesh) {
  namespace Collapse = CGAL::Surface_mesh_simplification;
  const size_t edges = faces * 3 / 2;  // of a closed mesh
  Collapse::edge_collapse(*mesh, Collapse::Count_stop_predicate<Mesh>(edges));
  mesh->collect_garbage();
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) return Fail("project SHAPE IN OUT, or simplify IN FACES OUT");
  const std::string command = argv[1];
  const bool project = command == "project";
  if (!project && command != "simplify") return Fail("no command '" + command + "'");
  Mesh mesh;
  if (!CGAL::IO::read_OFF(argv[project ? 3 : 2], mesh)) return Fail("cannot read the mesh");
  if (project) {
    const auto shape = rilievo::MakeShape(argv[2]);
    if (!shape.ok()) return Fail(std::string(shape.status().message()));
    Project(**shape, &mesh);
  } else {
    Simplify(static_cast<size_t>(std::atoll(argv[3])), &mesh);
  }
  std::ofstream out(argv[4]);
  out.precision(9);
  if (!CGAL::IO::write_OFF(out, mesh)) return Fail("cannot write the mesh");
  return 0;
}

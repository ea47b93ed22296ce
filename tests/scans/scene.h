// Made-up scenes of flat faces, as scanners on tripods and in aircraft see them.
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// A scanner on a tripod: it turns all the way round and sees from `lowest` to `highest`, radians
// above the horizon.
struct Station {
  Eigen::Vector3d position;
  double lowest = 0, highest = 0;
};

// Parallel strips along x at a height over z = 0, each as wide as the half angle lets it see.
struct Flight {
  int strips = 0;
  double height = 0, half_angle = 0;  // radians
};

// The leaves of a tree: a ball in which a ray comes `free_path` far on the average.
struct Crown {
  Eigen::Vector3d middle;
  double radius = 0, free_path = 0;
};

// Unit: metres. Faces are cut into triangles about as large as a scan of 100 000 points is dense,
// so that each is either seen or not; they may meet in T-junctions. Counter-clockwise seen from
// outside of what is solid. Either stations or a flight.
struct Scene {
  std::string name;
  TriangleMesh truth;
  std::vector<Station> stations;
  Flight flight;
  std::vector<Crown> crowns = {};  // no part of the truth
  Eigen::AlignedBox3d bounds() const;
};

// A street between two rows of houses with windows, seen from three stations: kerbs, cars, posts.
Scene MakeStreet();

// A block of houses with gabled roofs on rolling ground, seen from the air.
Scene MakeBlock();

// The same, with trees between the houses.
Scene MakeGarden();

// Two furnished rooms with a door between them, seen from inside.
Scene MakeRooms();

}  // namespace rilievo

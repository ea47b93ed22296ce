// What the accuracy of a reconstruction is measured on: a simulated scan and the truth behind it.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/point_cloud.h"

namespace rilievo {

// The surface that was scanned.
class Truth {
 public:
  virtual ~Truth() = default;
  struct Nearest {
    double distance;
    Eigen::Vector3d
        normal;  // unit, towards the outside; of a face in a scene, where it was seen from
  };
  virtual Nearest NearestTo(const Eigen::Vector3d& place) const = 0;
};

struct SubjectName {
  std::string shape;         // see SubjectShapes()
  double noise_percent = 0;  // standard deviation, of the diagonal
  int64_t points = 0;
  uint64_t seed = 1;  // of the places of the points and of their noise
};

struct Subject {
  PointCloud scan;
  std::unique_ptr<Truth> truth;
  Eigen::Matrix3Xd seen;  // places spread evenly over the part of the truth that was seen
  double diagonal = 0;    // unit of the scan, as are all lengths here
  double noise = 0;
};

// Closed smooth shapes, machined ones, thin walls, open ones, and scenes seen from stations and
// from the air; NAME-stations: the same scan, which says where each point was seen from.
std::vector<std::string> SubjectShapes();

// The same bytes each time. INVALID_ARGUMENT for a shape of another name.
absl::StatusOr<Subject> MakeSubject(const SubjectName& name);

}  // namespace rilievo

// Stations of a PLY file: an element 'station' with x, y, z that vertices name by number.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "absl/status/status.h"
#include "client/formats/byte_source.h"
#include "client/formats/ply_header.h"
#include "client/formats/sight_collector.h"

namespace rilievo {

class PlyStations {
 public:
  // Nothing is read where the header has no such element.
  PlyStations(const PlyHeader& header, const WantedLayers& wanted);

  // The number of the element in the header; -1: there is none, or none is wanted.
  int element() const { return element_; }

  // Reads the element.
  absl::Status Read(ByteSource* source, const PlyHeader& header);

  // The property 'station' of the next vertex; a negative one is not known.
  void AddVertex(double number) { numbers_.push_back(number); }

  // The stations of all vertices, once both elements were read. INVALID_ARGUMENT for a number that
  // the table does not have.
  absl::Status Finish(SightCollector* sights) const;

 private:
  int element_ = -1;
  std::vector<Eigen::Vector3d> places_;
  std::vector<double> numbers_;  // by vertex
};

}  // namespace rilievo

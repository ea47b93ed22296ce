// Scans in the formats people have: PLY, PCD, XYZ/PTS/TXT, OBJ, LAS, LAZ, E57, PTX.
#pragma once

#include <cstdint>
#include <istream>
#include <string>
#include <vector>

#include "absl/status/statusor.h"
#include "client/formats/point_layers.h"
#include "core/geometry/point_cloud.h"
#include "core/geometry/scan_place.h"

namespace rilievo {

struct ScanFile {
  PointCloud cloud;         // as in the file: double, non-finite points kept; sights where wanted
  std::string format;       // for people: "PLY binary_little_endian", "PCD ascii", ...
  PointLayers layers = {};  // intensity where wanted
  uint64_t faces = 0;       // that the file says it has besides: its points are a mesh's vertices
  ScanPlace place = {};     // what the format says of it: E57 the unit, LAS and LAZ up and CRS
  // By class, of all points of the file, where some were chosen by their classes; empty where not
  // each had one, and once ReadScanStream() has told.
  std::vector<int64_t> class_counts = {};
};

// All readers stream, hold no more than the points and one block, and believe no count of a header
// before the bytes that are really there allow it. Errors: INVALID_ARGUMENT for what breaks the
// format, DATA_LOSS for what ends too early; the message names the part of the file, the line,
// element or property, the value found, and what would be right.
//
// Colours that are all black are none, as in fields that a program had nothing for. Where some
// points have no colour (a short line, isColorInvalid of E57), they take that of the point before.

// Any property types and order, lists, other elements before and after, either byte order. Colours
// are the properties red, green and blue or r, g and b (8 bits, the high 8 of longer integers, real
// numbers from 0 to 1), classes classification or scalar_Classification; the intensity is intensity
// or scalar_Intensity. Normals are nx, ny, nz or normal_x, normal_y, normal_z; the sensor's place
// is sensor_x, sensor_y, sensor_z, or the property station, the number of an element 'station' with
// x, y, z (-1: not known).
absl::StatusOr<ScanFile> ReadPlyScan(std::istream& in, const WantedLayers& wanted = {});

// Point Cloud Library files, version 0.6 and 0.7: ascii, binary, binary_compressed; any fields.
// Normals are normal_x, normal_y, normal_z; the sensor's place is vp_x, vp_y, vp_z, or that of
// VIEWPOINT, whose default, 0 0 0 1 0 0 0, says nothing. Colours are the field rgb or rgba, packed
// as the library does, or r, g, b; classes and intensities as in PLY.
absl::StatusOr<ScanFile> ReadPcdScan(std::istream& in, const WantedLayers& wanted = {});

// Lines of numbers, x y z first (or where a heading says, see xyz_heading.h), separated by blanks,
// tabs, commas or semicolons (see NextField(): an empty field is a column too); further columns are
// passed over, but for the normals, the sensor's place, colours, classes and intensities that a
// heading names, as in PLY. What a line lacks of these is not known; x, y and z must be there.
// Without a heading the last three of six or seven columns are colours where all are whole numbers
// from 0 to 255.
// Comments start with #, // or %. A line with a single whole number gives the count of the points
// that follow (PTS), several such blocks may follow; of four or seven columns the fourth is the
// intensity there.
absl::StatusOr<ScanFile> ReadXyzScan(std::istream& in, const WantedLayers& wanted = {});

// The 'v' lines of a Wavefront file; three numbers behind x, y and z are a colour.
absl::StatusOr<ScanFile> ReadObjScan(std::istream& in, const WantedLayers& wanted = {});

// ASPRS LAS 1.0 to 1.4 and LAZ (M. Isenburg, "LASzip: lossless compression of LiDAR data",
// Photogrammetric Engineering & Remote Sensing 79, 2013), point formats 0 to 10. Integers become
// coordinates in double, so map grids keep what the file has. Points marked as withheld are left
// out. 16-bit colours become 8 bits. The coordinate reference system is that of the variable length
// records (las_variable_records.h); which unit it has is not asked of it. With a trajectory a
// point's station is where that was at its GPS time. INVALID_ARGUMENT for a trajectory where the
// points have no times, or none that it has.
absl::StatusOr<ScanFile> ReadLasScan(std::istream& in, const WantedLayers& wanted = {});

// ASTM E57 1.0 (ASTM E2807-11): all scans of the file, each moved by its own pose into the common
// frame. The station of a scan is the origin of its own coordinates, where these are spherical or
// have a pose that is not the identity. Points marked as invalid are left out. Each page that is
// read is compared with its checksum. A pipe is read into memory first. Colours become 8 bits by
// their limits. The unit is the metre, the coordinate reference system that of the element
// coordinateMetadata. Normals are those of the extension E57_NOR_surface_normals (nor:normalX,
// ...), turned by the pose; points of scans without them have none where others do.
absl::StatusOr<ScanFile> ReadE57Scan(std::istream& in, const WantedLayers& wanted = {});

// Leica's PTX: one or more grids of points, each moved by its own transform into the common frame,
// with the registered position for its station.
// Rays without a return (0 0 0) are left out.
absl::StatusOr<ScanFile> ReadPtxScan(std::istream& in, const WantedLayers& wanted = {});

// Chooses by content first, by the extension of `name` second. Keeps the points of wanted.classes
// alone, where these are given: INVALID_ARGUMENT when the file has no classes or no point of them.
absl::StatusOr<ScanFile> ReadScanStream(std::istream& in, const std::string& name,
                                        const WantedLayers& wanted = {});

// Opens the file; "-" reads the standard input. NOT_FOUND, PERMISSION_DENIED or the errors above;
// the message begins with the path.
absl::StatusOr<ScanFile> ReadScan(const std::string& path, const WantedLayers& wanted = {});

}  // namespace rilievo

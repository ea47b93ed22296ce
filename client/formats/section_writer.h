// Plane sections out: polylines as OBJ, DXF or SVG.
#pragma once

#include <ostream>
#include <span>
#include <string>

#include "absl/status/status.h"
#include "core/surface/plane_section.h"

namespace rilievo {

// An object for each section; v and l lines. Coordinates are those of the sections; each number is
// the shortest text that reads back the same.
absl::Status WriteObjSections(std::span<const PlaneSection> sections, std::ostream& out);

// AutoCAD's ASCII format, release 12: a 3-D POLYLINE for each polyline, on the layer section_1,
// section_2, ... Coordinates as above.
absl::Status WriteDxfSections(std::span<const PlaneSection> sections, std::ostream& out);

// One section in the axes of its plane (AxesOf), seen from the tip of the normal, closed polylines
// filled by the even-odd rule. The picture's unit is that of the section, its origin the upper left
// corner of the section; the description says where that lies. INVALID_ARGUMENT for more than one
// section, and for one without polylines.
absl::Status WriteSvgSection(std::span<const PlaneSection> sections, std::ostream& out);

// By the extension of `path`: .obj, .dxf or .svg; INVALID_ARGUMENT for any other. Atomic, see
// WriteFileAtomically().
absl::Status WriteSections(const std::string& path, std::span<const PlaneSection> sections);

}  // namespace rilievo

// The same heights over another control mesh of the same faces: what moves the control points moves
// the surface, and its detail rides along.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "absl/status/statusor.h"
#include "core/geometry/triangle_mesh.h"

namespace rilievo {

// A .dss file, whole or a prefix of whole chunks, with the control points and the tags of `cage`
// (scan frame) in the place of its own. The chunks of heights and colours stay as they are, since
// heights stand along the limit normals of whatever smooth surface there is (Lee, Moreton and Hoppe
// 2000, section 6, "animation"). Control points come back to within 1e-7 of the diagonal, those
// of a cage of more than ten diagonals to within 2^-26 of its size; points
// that all lie on the grid of the file stay on it, so that a cage that did not change gives the
// same bytes. Heights in groups keep their groups, which the file then tells (docs/dss-format.md,
// section 4.5). What the file states of its scan (errors, folds, number and hash of the points)
// goes, unless nothing changed.
//
// INVALID_ARGUMENT when vertices or faces of `cage` are not those of the file (in any order of the
// faces), a tag is not an edge or vertex of it, or a coordinate is not finite; FAILED_PRECONDITION
// for a file of version 1 or 2. Else the errors of DecodeDss.
absl::StatusOr<std::vector<uint8_t>> ReplaceControlMesh(std::span<const uint8_t> dss,
                                                        const ControlMesh& cage);

}  // namespace rilievo

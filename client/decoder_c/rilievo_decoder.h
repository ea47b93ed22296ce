/* The decoder of .dss surfaces for C, and for every language that can call C.
 *
 * A surface is decoded once and tessellated at any level. Functions that can fail return a
 * RilievoCode; the sentence that goes with it is rilievo_last_error(). No C++ exception leaves the
 * library, and it neither prints nor reads files. Objects may be read by many threads at once;
 * whoever made one frees it, once. A pointer that a function gives out lives as long as the object
 * it was asked of; `count`, which may be NULL, receives the number of elements behind it. Where
 * there are none the pointer may be NULL.
 *
 * Stable: functions are added, never changed; see rilievo_decoder_abi_version(). */
#ifndef RILIEVO_DECODER_H_
#define RILIEVO_DECODER_H_

#include <stddef.h>
#include <stdint.h>

#if defined(__GNUC__)
#define RILIEVO_API __attribute__((visibility("default")))
#else
#define RILIEVO_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

/* The numbers are those of gRPC's status codes. */
typedef enum RilievoCode {
  RILIEVO_OK = 0,
  RILIEVO_INVALID_ARGUMENT = 3,    /* an argument out of range, or bytes that are no .dss */
  RILIEVO_RESOURCE_EXHAUSTED = 8,  /* no memory left */
  RILIEVO_FAILED_PRECONDITION = 9, /* since 6, of rilievo_combine() and rilievo_trim() alone */
  RILIEVO_UNIMPLEMENTED = 12,      /* a newer format version */
  RILIEVO_INTERNAL = 13,           /* a defect of this library */
  RILIEVO_DATA_LOSS = 15           /* cut off or corrupted; the sentence names the chunk */
} RilievoCode;

/* Where a height comes from: the flag of a vertex. Smoothed heights are told from measured ones
 * once the whole file is there; files written before the format had that have none. */
enum { RILIEVO_MEASURED = 0, RILIEVO_SMOOTHED = 1, RILIEVO_FILLED = 2 };

typedef struct RilievoSurface RilievoSurface;
typedef struct RilievoMesh RilievoMesh;
typedef struct RilievoEvaluator RilievoEvaluator;
typedef struct RilievoFinder RilievoFinder;
typedef struct RilievoVoxels RilievoVoxels;
typedef struct RilievoPolygons RilievoPolygons;

/* 10; grows when functions are added. */
RILIEVO_API int rilievo_decoder_abi_version(void);

/* "MAJOR.MINOR.PATCH" of rilievo. */
RILIEVO_API const char* rilievo_decoder_version(void);

/* Why the last function of this thread that failed has failed; "" before that. Valid until the
 * next failure in this thread. */
RILIEVO_API const char* rilievo_last_error(void);

/* How many of the first `size` bytes of a file are whole chunks up to the heights of `max_level`
 * (negative: all levels): what rilievo_decode() takes of a file that is still on its way, or that
 * is wanted coarser than it is. Finest levels without a chunk of their own come with the last that
 * has one. 0 when the control mesh is not whole yet. Looks at the lengths of
 * the chunks only. INVALID_ARGUMENT when the bytes do not begin like a .dss file. */
RILIEVO_API RilievoCode rilievo_whole_bytes(const uint8_t* bytes, size_t size, int max_level,
                                            size_t* whole);

/* Any beginning of a file that ends with a whole chunk; the bytes are not needed afterwards.
 * `threads`: 0 for one a core; a library built without threads works with one. The result does not
 * depend on it. On failure *surface is NULL. */
RILIEVO_API RilievoCode rilievo_decode(const uint8_t* bytes, size_t size, int threads,
                                       RilievoSurface** surface);
RILIEVO_API void rilievo_surface_free(RilievoSurface* surface); /* NULL is fine */

/* Levels of heights that are there, [0, rilievo_surface_declared_max_level()]. */
RILIEVO_API int rilievo_surface_max_level(const RilievoSurface* surface);
/* Levels of heights that the whole file has. */
RILIEVO_API int rilievo_surface_declared_max_level(const RilievoSurface* surface);

/* What the file says of itself, one JSON object, UTF-8: format_version, frame (center, diagonal),
 * levels (vertices and faces of each that is there), max_level, declared_max_level,
 * chunk_bytes, control (vertices, faces, closed, creases, corners, scheme: "loop", or
 * "catmull-clark" where faces are halves of quads), certificate (error_rms,
 * error_mean, error_p95, error_max, error_across, surface_to_scan and scan_to_surface with rms,
 * mean, p95, max; measured_share, smoothed_share, filled_share, folds; distances are fractions of
 * frame.diagonal, null where unknown), place (metres_per_unit: of the coordinates; up: "x" to "-z",
 * the axis that points up; crs: coordinate reference system, well-known text or "EPSG:" and a
 * number; null where unknown), metadata (generator, road: the topology of the control mesh,
 * scan_points, input_hash in hexadecimal digits, options). Unknown keys may be added. Ends with a
 * zero byte that `count` leaves out. */
RILIEVO_API const char* rilievo_surface_info(const RilievoSurface* surface, size_t* count);

/* x, y, z of the frame's centre, then its diagonal: point = unit * diagonal + centre. */
RILIEVO_API const double* rilievo_surface_frame(const RilievoSurface* surface, size_t* count);

/* Displacement of each vertex of max_level along its limit normal, fractions of the diagonal; the
 * vertices of a coarser level come first (they nest). */
RILIEVO_API const float* rilievo_surface_heights(const RilievoSurface* surface, size_t* count);

/* Since 9. By which the last update of the file (`rilievo update`) changed each of these heights,
 * fractions of the diagonal; none where the file has no updates. */
RILIEVO_API const float* rilievo_surface_height_changes(const RilievoSurface* surface,
                                                        size_t* count);

/* Since 4. Red, green and blue (sRGB) of each of these vertices; none where the file has no
 * colours. */
RILIEVO_API const uint8_t* rilievo_surface_colors(const RilievoSurface* surface, size_t* count);

/* The control mesh, scan frame: x, y, z of each control point; three vertex numbers a face,
 * counter-clockwise seen from outside; two vertex numbers a crease with its sharpness (10 and more:
 * sharp at every level, as in OpenSubdiv); the vertices that are corners. Edges on a border are
 * sharp without being named. Of a Catmull-Clark surface each face is half of a quad: see
 * rilievo_control_diagonals(). */
RILIEVO_API const double* rilievo_control_vertices(const RilievoSurface* surface, size_t* count);
RILIEVO_API const uint32_t* rilievo_control_faces(const RilievoSurface* surface, size_t* count);
RILIEVO_API const uint32_t* rilievo_control_creases(const RilievoSurface* surface, size_t* count);
RILIEVO_API const float* rilievo_control_sharpness(const RilievoSurface* surface, size_t* count);
RILIEVO_API const uint32_t* rilievo_control_corners(const RilievoSurface* surface, size_t* count);

/* Since 10. Two vertex numbers for each quad of a Catmull-Clark surface: the diagonal that cuts it
 * into two faces of rilievo_control_faces(), lower number first, ascending. None of a Loop surface,
 * whose faces are whole. */
RILIEVO_API const uint32_t* rilievo_control_diagonals(const RilievoSurface* surface, size_t* count);

/* Since 7. The surface with other control points and tags: what moves its control mesh moves it,
 * and its heights ride along. `vertices`: x, y, z of each of the `vertex_count` control points, in
 * their order, scan frame. `creases`: two vertex numbers for each of `crease_count` edges, with
 * their `sharpness`, above 0, kept in 1/16. `corners`: `corner_count` vertices. NULL for `creases`
 * or `corners`: those of the surface. The new surface has no certificate and no chunks. It does not
 * need the one before. On failure *moved is NULL. */
RILIEVO_API RilievoCode rilievo_surface_with_cage(const RilievoSurface* surface,
                                                  const double* vertices, size_t vertex_count,
                                                  const uint32_t* creases, const float* sharpness,
                                                  size_t crease_count, const uint32_t* corners,
                                                  size_t corner_count, RilievoSurface** moved);

/* The surface as triangles. `level` in [0, max_level + 2]; `threads` as above. */
RILIEVO_API RilievoCode rilievo_tessellate(const RilievoSurface* surface, int level, int threads,
                                           RilievoMesh** mesh);

/* As few triangles as stay within `tolerance` (fraction of the diagonal, [0, 1]) of the finest
 * level when `triangles` is 0; else at most that many triangles, and `tolerance` is not used.
 * *error, which may be NULL, receives the largest distance, fraction of the diagonal. */
RILIEVO_API RilievoCode rilievo_tessellate_adaptively(const RilievoSurface* surface,
                                                      double tolerance, int64_t triangles,
                                                      int threads, RilievoMesh** mesh,
                                                      double* error);

/* Since 2. Some control faces of a file without the rest, at `level` (negative: the finest that is
 * there), bit for bit as rilievo_tessellate() gives them: parts taken one by one fit. `faces`:
 * `face_count` numbers of control faces, ascending, each once. Of a file in groups (large surfaces)
 * only what the faces depend on is looked at, and other files are decoded whole. On failure *mesh
 * is NULL. */
RILIEVO_API RilievoCode rilievo_decode_region(const uint8_t* bytes, size_t size,
                                              const uint32_t* faces, size_t face_count, int level,
                                              int threads, RilievoMesh** mesh);
RILIEVO_API void rilievo_mesh_free(RilievoMesh* mesh); /* NULL is fine */

/* x, y, z of each vertex, scan frame. */
RILIEVO_API const double* rilievo_mesh_vertices(const RilievoMesh* mesh, size_t* count);
/* Three vertex numbers a triangle, counter-clockwise seen from outside. */
RILIEVO_API const uint32_t* rilievo_mesh_faces(const RilievoMesh* mesh, size_t* count);
/* x, y, z of the unit normal of each vertex. */
RILIEVO_API const float* rilievo_mesh_normals(const RilievoMesh* mesh, size_t* count);
/* RILIEVO_MEASURED, RILIEVO_SMOOTHED or RILIEVO_FILLED for each vertex. */
RILIEVO_API const uint8_t* rilievo_mesh_flags(const RilievoMesh* mesh, size_t* count);
/* Since 4. Red, green and blue (sRGB) of each vertex; none where the surface has no colours. */
RILIEVO_API const uint8_t* rilievo_mesh_colors(const RilievoMesh* mesh, size_t* count);
/* Since 2. Of a region: the number that each vertex has in the whole mesh of the level, ascending;
 * none for other meshes. */
RILIEVO_API const uint32_t* rilievo_mesh_vertex_numbers(const RilievoMesh* mesh, size_t* count);

/* Since 6. A mesh of triangles from elsewhere: x, y, z of each vertex, three vertex numbers a
 * triangle. Equal vertices are one; what hangs together faces outwards; where more than two
 * triangles meet at an edge those that bound a solid are linked. So vertices and triangles may be
 * others than those given. It has no normals and no flags. On failure *mesh is NULL. */
RILIEVO_API RilievoCode rilievo_mesh_create(const double* vertices, size_t vertex_count,
                                            const uint32_t* faces, size_t face_count, int threads,
                                            RilievoMesh** mesh);

/* What lies in either of two solids, in both, or in the first alone. */
enum { RILIEVO_UNION = 0, RILIEVO_INTERSECTION = 1, RILIEVO_DIFFERENCE = 2 };

/* Since 6. The solid that two closed meshes, of the same coordinates, make together: triangles
 * again, closed, without normals and flags. FAILED_PRECONDITION where a mesh is open, is inside out
 * or overlaps itself where the other one cuts it, where both touch at too flat an angle to decide
 * which parts are joined, and where nothing is left. On failure *mesh is NULL. */
RILIEVO_API RilievoCode rilievo_combine(const RilievoMesh* a, const RilievoMesh* b, int operation,
                                        int threads, RilievoMesh** mesh);

/* What a mesh is trimmed by, and its numbers, in the coordinates of the mesh: A, B, C and D of the
 * plane A x + B y + C z = D, inside of which that is less than D; two opposite corners of a box,
 * the lower one first; centre and radius of a sphere; the direction of a prism and the corners of
 * the closed polyline that is swept along it. */
enum { RILIEVO_PLANE = 0, RILIEVO_BOX = 1, RILIEVO_SPHERE = 2, RILIEVO_PRISM = 3 };

/* Since 8. The part of a mesh, open or closed, inside of a shape, or outside. The borders of both
 * lie on the shape and are the same, to the last bit. `cap`: not 0 to close it along the shape, of
 * a closed mesh, and with the errors of rilievo_combine(). FAILED_PRECONDITION where nothing is
 * left. On failure *trimmed is NULL. */
RILIEVO_API RilievoCode rilievo_trim(const RilievoMesh* mesh, int shape, const double* numbers,
                                     size_t count, int outside, int cap, int threads,
                                     RilievoMesh** trimmed);

/* Since 8. A mesh of polygons refined by a scheme: "loop", "butterfly" and "sqrt3" (of triangles),
 * "catmull-clark", "doo-sabin". `corner_counts`: of each face its number of corners; `corners`: the
 * vertex numbers of all faces in turn, `corner_count` of them; `levels`: 0 to 8. INVALID_ARGUMENT
 * for faces that are not an oriented manifold. On failure *polygons is NULL. */
RILIEVO_API RilievoCode rilievo_subdivide(const double* vertices, size_t vertex_count,
                                          const uint32_t* corners, size_t corner_count,
                                          const uint32_t* corner_counts, size_t face_count,
                                          const char* scheme, int levels,
                                          RilievoPolygons** polygons);
RILIEVO_API void rilievo_polygons_free(RilievoPolygons* polygons); /* NULL is fine */
/* x, y, z of each vertex; the vertex numbers of all faces; how many each face has. */
RILIEVO_API const double* rilievo_polygons_vertices(const RilievoPolygons* polygons, size_t* count);
RILIEVO_API const uint32_t* rilievo_polygons_corners(const RilievoPolygons* polygons,
                                                     size_t* count);
RILIEVO_API const uint32_t* rilievo_polygons_corner_counts(const RilievoPolygons* polygons,
                                                           size_t* count);

/* Since 8. The control mesh of a Loop surface through all vertices of a mesh of triangles, open or
 * closed: each triangle split into four, the given vertices first. INVALID_ARGUMENT for faces that
 * are not an oriented manifold. It has no normals and no flags. On failure *cage is NULL. */
RILIEVO_API RilievoCode rilievo_interpolate(const double* vertices, size_t vertex_count,
                                            const uint32_t* faces, size_t face_count,
                                            RilievoMesh** cage);

/* Since 3. The surface at any parameter of a control face: u weighs its second corner, v its third,
 * u >= 0, v >= 0, u + v <= 1. It passes through the vertices of the finest level; between them the
 * limit surface is exact and what displaces it is linear. `smooth`: not 0 for the limit surface
 * alone, without heights. The surface is not needed afterwards. On failure *evaluator is NULL. */
RILIEVO_API RilievoCode rilievo_evaluator_create(const RilievoSurface* surface, int smooth,
                                                 int threads, RilievoEvaluator** evaluator);
RILIEVO_API void rilievo_evaluator_free(RilievoEvaluator* evaluator); /* NULL is fine */

/* Numbers of each parameter in what rilievo_evaluate() writes. */
enum { RILIEVO_JET_SIZE = 23 };

/* Since 3. At `count` parameters: `faces` one number each, `parameters` u and v of each. `jets` has
 * room for RILIEVO_JET_SIZE * count numbers and receives for each: position (x, y, z, scan frame),
 * its derivatives by u, v, uu, uv and vv, the unit normal, the least and the greatest principal
 * curvature (positive where the surface bends away from its normal). At an irregular vertex u and v
 * span the tangent plane, and second derivatives and curvatures are not a number. */
RILIEVO_API RilievoCode rilievo_evaluate(const RilievoEvaluator* evaluator, const uint32_t* faces,
                                         const double* parameters, size_t count, int threads,
                                         double* jets);

/* Since 3. Closest points of that surface. On failure *finder is NULL. */
RILIEVO_API RilievoCode rilievo_finder_create(const RilievoSurface* surface, int smooth,
                                              int threads, RilievoFinder** finder);
RILIEVO_API void rilievo_finder_free(RilievoFinder* finder); /* NULL is fine */

/* Since 3. Of `count` places (x, y, z of each, finite, scan frame) the closest points of the
 * surface: its control face, its parameters u and v, its distance, and where it is (x, y, z). Each
 * of the four arrays has room for all. */
RILIEVO_API RilievoCode rilievo_find_closest(const RilievoFinder* finder, const double* places,
                                             size_t count, int threads, uint32_t* faces,
                                             double* parameters, double* distances,
                                             double* positions);

/* What the voxels of a surface tell: which ones it meets; of a closed one, whose centres are
 * inside; how far their centres are from it, negative inside of a closed one. */
enum { RILIEVO_SHELL = 0, RILIEVO_SOLID = 1, RILIEVO_DISTANCE = 2 };

/* Since 5. The triangles of `level` (negative: the finest that is there) as voxels: `resolution` of
 * them, [1, 2048], along the longest side of the bounding box, or with 0 such of edge length
 * `voxel`, scan unit. Distances are exact up to `band` voxels, [1, 1023], and that far beyond; the
 * other kinds do not use it. INVALID_ARGUMENT also for a solid of an open surface. On failure
 * *voxels is NULL. */
RILIEVO_API RilievoCode rilievo_voxelize(const RilievoSurface* surface, int level, int kind,
                                         int resolution, double voxel, int band, int threads,
                                         RilievoVoxels** voxels);
RILIEVO_API void rilievo_voxels_free(RilievoVoxels* voxels); /* NULL is fine */

/* Since 5. x, y, z of the corner of the first voxel, scan frame, then the edge length of all. */
RILIEVO_API const double* rilievo_voxels_frame(const RilievoVoxels* voxels, size_t* count);
/* Since 5. How many voxels there are along x, y and z. */
RILIEVO_API const uint32_t* rilievo_voxels_size(const RilievoVoxels* voxels, size_t* count);
/* Since 5. 1 for each voxel of a shell or a solid, 0 for the others; x runs fastest, z slowest.
 * None for distances. */
RILIEVO_API const uint8_t* rilievo_voxels_filled(const RilievoVoxels* voxels, size_t* count);
/* Since 5. The distances in the same order, scan unit; none for shells and solids. */
RILIEVO_API const float* rilievo_voxels_distances(const RilievoVoxels* voxels, size_t* count);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* RILIEVO_DECODER_H_ */

/* What the page needs beside the decoder (client/decoder_c/rilievo_decoder.h): the readers of
 * scans, the distance of a scan to a surface, and mesh files. Same rules as there. Points are x, y,
 * z. */
#ifndef RILIEVO_PAGE_H_
#define RILIEVO_PAGE_H_

#include "client/decoder_c/rilievo_decoder.h"

#ifdef __cplusplus
extern "C" {
#endif

typedef struct RilievoScan RilievoScan;
typedef struct RilievoBytes RilievoBytes;

/* A scan file in any format that the command line reads; `name` for its extension. */
RILIEVO_API RilievoCode rilievo_page_read_scan(const char* bytes, size_t size, const char* name,
                                               RilievoScan** scan);
RILIEVO_API void rilievo_page_scan_free(RilievoScan* scan);
/* Scan frame, as in the file: non-finite points are kept. */
RILIEVO_API const double* rilievo_page_scan_points(const RilievoScan* scan, size_t* count);
/* What its coordinates stand for, as rilievo_surface_info() writes "place". */
RILIEVO_API const char* rilievo_page_scan_place(const RilievoScan* scan);
/* For people: "PLY binary_little_endian". */
RILIEVO_API const char* rilievo_page_scan_format(const RilievoScan* scan);
/* PointChunk.data for all points, with their stations and normals where the scan has them:
 * coordinates are float32 where that loses nothing (*coordinate_bytes 4), else float64 (8). *sha256
 * is of these bytes. */
RILIEVO_API const uint8_t* rilievo_page_scan_packed(RilievoScan* scan, int* coordinate_bytes,
                                                    uint8_t* sha256, size_t* count);

/* ReconstructHeader.stations, x, y, z each; none where the scan has none. */
RILIEVO_API const double* rilievo_page_scan_stations(const RilievoScan* scan, size_t* count);
/* ReconstructHeader.normals: 1 where the scan has them, else 0. */
RILIEVO_API int rilievo_page_scan_has_normals(const RilievoScan* scan);

/* One figure a vertex: the RMS distance, scan unit, of the finite points whose nearest triangle
 * touches it; NaN where there is none (core/surface/error_at_vertices.h). *rms, which may be NULL,
 * is that of all points. */
RILIEVO_API RilievoCode rilievo_page_scan_distance(const RilievoScan* scan, const RilievoMesh* mesh,
                                                   float* distances, double* rms);

/* Which layers the scan has: 1 colours, 2 intensity, 3 both. */
RILIEVO_API int rilievo_page_scan_layers(const RilievoScan* scan);
/* Red, green, blue of the scan's point nearest to each vertex, three bytes a vertex; none where the
 * scan has no colours. An error where it has no layer at all. */
RILIEVO_API RilievoCode rilievo_page_scan_colors(const RilievoScan* scan, const RilievoMesh* mesh,
                                                 RilievoBytes** bytes);

/* A mesh as a file, PLY or binary glTF, with normals and flags; with the layers of `carried`, as
 * `rilievo export --carry` writes them, unless that is NULL. The GLB stands as `surface`, of which
 * the mesh is, says that its coordinates do. */
RILIEVO_API RilievoCode rilievo_page_write_ply(const RilievoMesh* mesh, const RilievoScan* carried,
                                               RilievoBytes** bytes);
RILIEVO_API RilievoCode rilievo_page_write_glb(const RilievoSurface* surface,
                                               const RilievoMesh* mesh, const RilievoScan* carried,
                                               RilievoBytes** bytes);
RILIEVO_API const uint8_t* rilievo_page_bytes(const RilievoBytes* bytes, size_t* count);
RILIEVO_API void rilievo_page_bytes_free(RilievoBytes* bytes);

/* The SHA-256 of the bytes, 32 bytes at `digest`: browsers have none of their own outside of secure
 * contexts. */
RILIEVO_API void rilievo_page_sha256(const uint8_t* bytes, size_t size, uint8_t* digest);

#ifdef __cplusplus
} /* extern "C" */
#endif

#endif /* RILIEVO_PAGE_H_ */

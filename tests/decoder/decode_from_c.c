/* The header as a C compiler sees it: reads a .dss, writes the triangles of a level as OBJ. */
#include <rilievo_decoder.h>
#include <stdio.h>
#include <stdlib.h>

static unsigned char* read_file(const char* path, size_t* size) {
  FILE* file = fopen(path, "rb");
  unsigned char* bytes = NULL;
  long length = -1;
  if (file == NULL) return NULL;
  if (fseek(file, 0, SEEK_END) == 0) length = ftell(file);
  if (length > 0 && fseek(file, 0, SEEK_SET) == 0) bytes = malloc((size_t)length);
  *size = bytes == NULL ? 0 : fread(bytes, 1, (size_t)length, file);
  fclose(file);
  return bytes;
}

int main(int argc, char** argv) {
  size_t size = 0, values = 0, i = 0;
  unsigned char* bytes = argc == 3 ? read_file(argv[1], &size) : NULL;
  RilievoSurface* surface = NULL;
  RilievoMesh* mesh = NULL;
  const double* vertices = NULL;
  const uint32_t* faces = NULL;
  if (bytes == NULL) {
    fprintf(stderr, "usage: decode_from_c IN.dss LEVEL > OUT.obj\n");
    return 2;
  }
  if (rilievo_decode(bytes, size, 0, &surface) != RILIEVO_OK ||
      rilievo_tessellate(surface, atoi(argv[2]), 0, &mesh) != RILIEVO_OK) {
    fprintf(stderr, "%s: %s\n", argv[1], rilievo_last_error());
    rilievo_surface_free(surface);
    free(bytes);
    return 1;
  }
  free(bytes);
  vertices = rilievo_mesh_vertices(mesh, &values);
  for (i = 0; i + 2 < values; i += 3) {
    printf("v %.9g %.9g %.9g\n", vertices[i], vertices[i + 1], vertices[i + 2]);
  }
  faces = rilievo_mesh_faces(mesh, &values);
  for (i = 0; i + 2 < values; i += 3) {
    printf("f %u %u %u\n", faces[i] + 1, faces[i + 1] + 1, faces[i + 2] + 1);
  }
  rilievo_mesh_free(mesh);
  rilievo_surface_free(surface);
  return 0;
}

# Debian 12 packages, found once. PCL is named library by library: PCL's own config file would pull
# in VTK, and Debian builds PCL, FLANN, Ceres and OpenMesh for plain x86-64, so no -march flags here.
find_package(Threads REQUIRED)
find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(absl REQUIRED)
find_package(Ceres 2.1 REQUIRED)
find_package(OpenMesh REQUIRED)
find_package(Protobuf 3.21 REQUIRED)
find_package(gRPC 1.51 REQUIRED)
find_package(OpenSSL 3 REQUIRED)
find_package(SQLite3 3.40 REQUIRED)
find_package(CURL 7.88 REQUIRED)
find_package(prometheus-cpp REQUIRED)
find_package(CLI11 REQUIRED)
find_package(nlohmann_json REQUIRED)
find_package(meshoptimizer REQUIRED)
find_package(PNG REQUIRED)
find_package(ZLIB REQUIRED)
find_package(PkgConfig REQUIRED)
pkg_check_modules(ZSTD REQUIRED IMPORTED_TARGET libzstd)
pkg_check_modules(LIBPQ REQUIRED IMPORTED_TARGET libpq>=15)

# flann.pc names MPI and HDF5, which only FLANN's own tools use.
add_library(rilievo_flann INTERFACE)
foreach(library flann_cpp lz4)
  find_library(FLANN_${library}_LIBRARY ${library} REQUIRED)
  target_link_libraries(rilievo_flann INTERFACE ${FLANN_${library}_LIBRARY})
endforeach()

if(RILIEVO_BUILD_TESTS)
  find_package(GTest REQUIRED)
endif()
if(RILIEVO_BUILD_TESTS OR RILIEVO_BUILD_BENCHMARKS)
  # The oracle of the Loop tests, and the measure of the decoder. Debian's own CMake file for it names files that no package holds.
  find_path(OSD_INCLUDE_DIR opensubdiv/far/stencilTable.h REQUIRED)
  find_library(OSD_CPU_LIBRARY osdCPU REQUIRED)
  add_library(rilievo_opensubdiv INTERFACE)
  target_include_directories(rilievo_opensubdiv SYSTEM INTERFACE ${OSD_INCLUDE_DIR})
  target_link_libraries(rilievo_opensubdiv INTERFACE ${OSD_CPU_LIBRARY})
endif()
if(RILIEVO_BUILD_BENCHMARKS)
  find_package(benchmark REQUIRED)
endif()

# The sandbox of the server's workers; Debian has no CMake file for it.
add_library(rilievo_seccomp INTERFACE)
find_library(SECCOMP_LIBRARY seccomp REQUIRED)
target_link_libraries(rilievo_seccomp INTERFACE ${SECCOMP_LIBRARY})

# Of PCL's libraries the common one alone, the rest being templates: its filters and what they pull in
# take a process 30 ms to load, and each job of the server is two processes, the client's and its own.
add_library(rilievo_pcl INTERFACE)
find_path(PCL_INCLUDE_DIR pcl/point_cloud.h PATH_SUFFIXES pcl-1.13 REQUIRED)
target_include_directories(rilievo_pcl SYSTEM INTERFACE ${PCL_INCLUDE_DIR})
target_link_libraries(rilievo_pcl INTERFACE Eigen3::Eigen)
# By its full name: who links an installed rilievo::core needs libpcl-common1.13, and not libpcl-dev with its
# five hundred packages.
find_library(RILIEVO_PCL_COMMON_LIBRARY NAMES libpcl_common.so.1.13 pcl_common REQUIRED)
target_link_libraries(rilievo_pcl INTERFACE ${RILIEVO_PCL_COMMON_LIBRARY})

# Open CASCADE, for STEP, is optional. Debian's CMake files for it ask for all of its packages.
option(RILIEVO_STEP "rilievo export writes STEP, by Open CASCADE where that is installed" ON)
if(RILIEVO_STEP)
  find_path(OPENCASCADE_INCLUDE_DIR STEPControl_Writer.hxx PATH_SUFFIXES opencascade)
  add_library(rilievo_opencascade INTERFACE)
  target_include_directories(rilievo_opencascade SYSTEM INTERFACE ${OPENCASCADE_INCLUDE_DIR})
  foreach(library TKSTEP TKSTEPBase TKXSBase TKShHealing TKTopAlgo TKBRep TKGeomBase TKG3d TKG2d TKMath TKernel)
    find_library(OPENCASCADE_${library}_LIBRARY ${library})
    target_link_libraries(rilievo_opencascade INTERFACE ${OPENCASCADE_${library}_LIBRARY})
    if(NOT OPENCASCADE_INCLUDE_DIR OR NOT OPENCASCADE_${library}_LIBRARY)
      set(opencascade_is_missing TRUE)
    endif()
  endforeach()
  if(opencascade_is_missing)
    message(STATUS "Without STEP: libocct-data-exchange-dev is not installed")
    set(RILIEVO_STEP OFF)
  endif()
endif()

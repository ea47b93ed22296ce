# Headers are installed under the name of the project: what the sources call "core/x.h" is
# <rilievo/core/x.h> there, and so for the others that include it.
file(GLOB_RECURSE headers "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/include/rilievo/*.h")
foreach(header IN LISTS headers)
  file(READ "${header}" before)
  string(REGEX REPLACE "#include \"(rilievo/)?((core|client|v1|google|grpc)/[^\"\n]+)\""
    "#include <rilievo/\\2>" after "${before}")
  if(NOT after STREQUAL before)
    file(WRITE "${header}" "${after}")
  endif()
endforeach()

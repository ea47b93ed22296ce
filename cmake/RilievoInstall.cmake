# What `cmake --install` lays out, by component: `programs` (with their manual pages, completion and
# systemd units), `viewer`, `step`, `decoder` (the C library for other languages), `decoder_development` (its
# header and pkg-config file), `python`, and `development` (headers, archives, a CMake package with
# rilievo::decoder, rilievo::core and rilievo::client, pkg-config files). Each is a Debian package.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# Manual pages and completion, from the programs' own descriptions.
set(shell_files ${CMAKE_BINARY_DIR}/shell)
file(MAKE_DIRECTORY ${shell_files})
add_custom_command(
  OUTPUT ${shell_files}/rilievo.1 ${shell_files}/rilievod.8 ${shell_files}/rilievo.bash
         ${shell_files}/_rilievo ${shell_files}/rilievo.fish
  COMMAND rilievo manual > ${shell_files}/rilievo.1
  COMMAND rilievod --help > ${shell_files}/rilievod.help
  COMMAND rilievo manual --of-server ${shell_files}/rilievod.help > ${shell_files}/rilievod.8
  COMMAND rilievo completion bash > ${shell_files}/rilievo.bash
  COMMAND rilievo completion zsh > ${shell_files}/_rilievo
  COMMAND rilievo completion fish > ${shell_files}/rilievo.fish
  DEPENDS rilievo rilievod
  COMMENT "Writing manual pages and shell completion"
  VERBATIM)
add_custom_target(rilievo_shell_files ALL DEPENDS ${shell_files}/rilievo.1)

set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME programs)
install(TARGETS rilievo rilievod rilievo-worker DESTINATION ${CMAKE_INSTALL_BINDIR})
install(FILES ${shell_files}/rilievo.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(FILES ${shell_files}/rilievod.8 DESTINATION ${CMAKE_INSTALL_MANDIR}/man8)
install(FILES ${shell_files}/rilievo.bash RENAME rilievo
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(FILES ${shell_files}/_rilievo DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
install(FILES ${shell_files}/rilievo.fish
  DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
install(FILES ${CMAKE_SOURCE_DIR}/cmake/install/rilievod.service
  ${CMAKE_SOURCE_DIR}/cmake/install/rilievo-worker@.service DESTINATION lib/systemd/system)

# The viewer, where client/web/build.sh has built it; it runs on Node, which it does not bring.
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME viewer)
install(FILES ${CMAKE_BINARY_DIR}/web/gateway.mjs DESTINATION ${CMAKE_INSTALL_DATADIR}/rilievo/web
  OPTIONAL)
install(DIRECTORY ${CMAKE_BINARY_DIR}/web/page DESTINATION ${CMAKE_INSTALL_DATADIR}/rilievo/web
  OPTIONAL)

# The decoder for other languages.
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME decoder)
install(TARGETS rilievo_decoder_c LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}
  NAMELINK_COMPONENT decoder_development)
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME decoder_development)
install(FILES ${CMAKE_SOURCE_DIR}/client/decoder_c/rilievo_decoder.h DESTINATION include/rilievo)
if(TARGET rilievo_python)
  install(DIRECTORY ${CMAKE_BINARY_DIR}/python/rilievo DESTINATION lib/python3/dist-packages
    COMPONENT python PATTERN complete EXCLUDE PATTERN __pycache__ EXCLUDE)
endif()

# What writes STEP, where Open CASCADE was found.
if(TARGET rilievo_step)
  install(TARGETS rilievo_step LIBRARY DESTINATION lib/rilievo COMPONENT step)
endif()

# One export a component, so that who decodes needs neither gRPC nor PCL. The archives lie in a
# folder of their own: librilievo_decoder.so, the C interface, has the same name.
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)
set(archives ${CMAKE_INSTALL_LIBDIR}/rilievo)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/rilievo)
set(decoder_targets rilievo_warnings rilievo_base rilievo_geometry rilievo_loop rilievo_surface
  rilievo_evaluate rilievo_voxels rilievo_decoder)
set(core_targets rilievo_flann rilievo_pcl rilievo_points rilievo_scan rilievo_registration rilievo_checked_meshes rilievo_meshes rilievo_bicubic rilievo_booleans rilievo_schemes rilievo_control rilievo_domain
  rilievo_displacement rilievo_codec rilievo_paging rilievo_pipeline)
set(client_targets rilievo_messages rilievo_proto rilievo_client)
foreach(component decoder core client)
  foreach(target IN LISTS ${component}_targets)
    string(REPLACE rilievo_ "" name ${target})
    if(name STREQUAL "pipeline")
      set(name core)
    endif()
    set_target_properties(${target} PROPERTIES EXPORT_NAME ${name})
  endforeach()
  install(TARGETS ${${component}_targets} EXPORT rilievo-${component} ARCHIVE DESTINATION ${archives})
  install(EXPORT rilievo-${component} NAMESPACE rilievo:: DESTINATION ${package})
endforeach()
install(DIRECTORY ${CMAKE_SOURCE_DIR}/core DESTINATION include/rilievo FILES_MATCHING PATTERN "*.h")
install(DIRECTORY ${CMAKE_SOURCE_DIR}/client/library DESTINATION include/rilievo/client
  FILES_MATCHING PATTERN "*.h")
install(DIRECTORY ${CMAKE_BINARY_DIR}/proto/generated/rilievo/ ${CMAKE_BINARY_DIR}/proto/generated/google
  ${CMAKE_BINARY_DIR}/proto/generated/grpc DESTINATION include/rilievo FILES_MATCHING PATTERN "*.pb.h")
install(SCRIPT ${CMAKE_SOURCE_DIR}/cmake/install/name_headers.cmake)
configure_package_config_file(${CMAKE_SOURCE_DIR}/cmake/install/rilievo-config.cmake.in
  ${CMAKE_BINARY_DIR}/rilievo-config.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/rilievo-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/rilievo-config.cmake
  ${CMAKE_BINARY_DIR}/rilievo-config-version.cmake DESTINATION ${package})
# Relocatable: the prefix is where the file lies.
file(RELATIVE_PATH pc_to_prefix /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
foreach(name rilievo-decoder rilievo-client rilievo-decoder-c)
  configure_file(${CMAKE_SOURCE_DIR}/cmake/install/${name}.pc.in ${CMAKE_BINARY_DIR}/${name}.pc
    @ONLY)
  if(name STREQUAL "rilievo-decoder-c")
    set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME decoder_development)
  endif()
  install(FILES ${CMAKE_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endforeach()

# Debian packages; the libraries that a program needs are asked of dpkg-shlibdeps.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME rilievo)
set(CPACK_PACKAGE_VENDOR Rilievo)
set(CPACK_PACKAGE_CONTACT "The maintainers of rilievo <maintainers@rilievo.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "point clouds to displaced subdivision surfaces")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_COMPONENTS_ALL)

# debian_package(COMPONENT NAME SECTION DESCRIPTION [ALL] [LIBRARIES] [DEPENDS packages] [SUGGESTS packages]):
# of an installed component. ALL: the same on every processor. LIBRARIES: asked of dpkg-shlibdeps.
macro(debian_package component name section description)
  cmake_parse_arguments(DEB "ALL;LIBRARIES" "DEPENDS;SUGGESTS" "" ${ARGN})
  list(APPEND CPACK_COMPONENTS_ALL ${component})
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section})
  set(CPACK_COMPONENT_${upper}_DESCRIPTION ${description})
  if(DEB_ALL)
    set(CPACK_DEBIAN_${upper}_PACKAGE_ARCHITECTURE all)
  endif()
  if(DEB_LIBRARIES)
    set(CPACK_DEBIAN_${upper}_PACKAGE_SHLIBDEPS ON)
  endif()
  set(CPACK_DEBIAN_${upper}_PACKAGE_DEPENDS ${DEB_DEPENDS})
  set(CPACK_DEBIAN_${upper}_PACKAGE_SUGGESTS ${DEB_SUGGESTS})
  install(FILES ${CMAKE_SOURCE_DIR}/LICENSE RENAME copyright
    DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/${name} COMPONENT ${component})
endmacro()
debian_package(programs rilievo graphics
  "The command rilievo and the server rilievod, which turn unorganized point clouds into compact
 multiresolution surfaces." LIBRARIES SUGGESTS rilievo-viewer)
debian_package(viewer rilievo-viewer graphics
  "The page on which scans become surfaces, and its gateway to rilievod." ALL
  DEPENDS "nodejs (>= 18.19), rilievo (>= ${PROJECT_VERSION})")
if(TARGET rilievo_step)
  debian_package(step rilievo-step graphics
    "What the command rilievo needs to write STEP files, by Open CASCADE." LIBRARIES
    DEPENDS "rilievo (= ${PROJECT_VERSION})")
endif()
debian_package(decoder librilievo-decoder1 libs
  "The decoder of .dss files behind a plain C interface." LIBRARIES)
set(CPACK_DEBIAN_DECODER_PACKAGE_GENERATE_SHLIBS ON)
debian_package(decoder_development librilievo-decoder-dev libdevel
  "Header and pkg-config file of the decoder of .dss files in C."
  DEPENDS "librilievo-decoder1 (= ${PROJECT_VERSION})")
if(TARGET rilievo_python)
  debian_package(python python3-rilievo python
    "Surfaces from point clouds and meshes with NumPy arrays: client and decoder." ALL
    DEPENDS "python3 (>= 3.9), python3-numpy, python3-grpcio, python3-protobuf, librilievo-decoder1 (>= ${PROJECT_VERSION})"
    SUGGESTS rilievo)
endif()
debian_package(development librilievo-dev libdevel
  "Headers and archives of rilievo: its decoder, its core and its client."
  DEPENDS "libeigen3-dev, libabsl-dev, libgrpc++-dev, libprotobuf-dev, libceres-dev, libopenmesh-dev, libpcl-common1.13, libflann-dev")
include(CPack)

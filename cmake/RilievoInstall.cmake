# What `cmake --install` lays out: the component `programs` (both programs, their manual pages,
# completion, the viewer and the systemd unit) and the component `development` (headers, archives, a CMake
# package with rilievo::decoder, rilievo::core and rilievo::client, pkg-config files).
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
# The viewer, where client/web/build.sh has built it; it runs on Node, which it does not bring.
install(FILES ${CMAKE_BINARY_DIR}/web/gateway.mjs DESTINATION ${CMAKE_INSTALL_DATADIR}/rilievo/web
  OPTIONAL)
install(DIRECTORY ${CMAKE_BINARY_DIR}/web/page DESTINATION ${CMAKE_INSTALL_DATADIR}/rilievo/web
  OPTIONAL)
install(FILES ${CMAKE_SOURCE_DIR}/cmake/install/rilievod.service
  ${CMAKE_SOURCE_DIR}/cmake/install/rilievo-worker@.service DESTINATION lib/systemd/system)
install(FILES ${CMAKE_SOURCE_DIR}/LICENSE RENAME copyright
  DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/rilievo)

# One export a component, so that who decodes needs neither gRPC nor PCL. The archives lie in a
# folder of their own: librilievo_decoder.so, the C interface, has the same name.
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)
set(archives ${CMAKE_INSTALL_LIBDIR}/rilievo)
set(package ${CMAKE_INSTALL_LIBDIR}/cmake/rilievo)
set(decoder_targets rilievo_warnings rilievo_base rilievo_geometry rilievo_loop rilievo_surface
  rilievo_evaluate rilievo_voxels rilievo_decoder)
set(core_targets rilievo_flann rilievo_pcl rilievo_points rilievo_scan rilievo_registration rilievo_checked_meshes rilievo_meshes rilievo_booleans rilievo_control rilievo_domain
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
install(DIRECTORY ${CMAKE_BINARY_DIR}/proto/generated/ DESTINATION include/rilievo
  FILES_MATCHING PATTERN "*.pb.h")
configure_package_config_file(${CMAKE_SOURCE_DIR}/cmake/install/rilievo-config.cmake.in
  ${CMAKE_BINARY_DIR}/rilievo-config.cmake INSTALL_DESTINATION ${package})
write_basic_package_version_file(${CMAKE_BINARY_DIR}/rilievo-config-version.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/rilievo-config.cmake
  ${CMAKE_BINARY_DIR}/rilievo-config-version.cmake DESTINATION ${package})
# Relocatable: the prefix is where the file lies.
file(RELATIVE_PATH pc_to_prefix /prefix/${CMAKE_INSTALL_LIBDIR}/pkgconfig /prefix)
foreach(name rilievo-decoder rilievo-client)
  configure_file(${CMAKE_SOURCE_DIR}/cmake/install/${name}.pc.in ${CMAKE_BINARY_DIR}/${name}.pc
    @ONLY)
  install(FILES ${CMAKE_BINARY_DIR}/${name}.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
endforeach()

# Two Debian packages; the libraries a program needs are asked of dpkg-shlibdeps.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME rilievo)
set(CPACK_PACKAGE_VENDOR Rilievo)
set(CPACK_PACKAGE_CONTACT "The maintainers of rilievo <maintainers@rilievo.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "point clouds to displaced subdivision surfaces")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_ALL programs development)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME rilievo)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SUGGESTS "nodejs (>= 18.19)")
set(CPACK_COMPONENT_PROGRAMS_DESCRIPTION
  "The command rilievo and the server rilievod, which turn unorganized point clouds into compact
 multiresolution surfaces.")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME librilievo-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "libeigen3-dev, libabsl-dev, libgrpc++-dev, libprotobuf-dev, libceres-dev, libopenmesh-dev, libpcl-dev, libflann-dev")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
  "Headers and archives of rilievo: its decoder, its core and its client.")
include(CPack)

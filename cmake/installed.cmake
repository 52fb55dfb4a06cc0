# Files that say where others of the installation are. The prefix may be another one when it is installed
# (cmake --install --prefix), or the installation may be moved afterwards.

# bushd_install_pkg_config(bushd-client.pc COMPONENT dev): from the template bushd-client.pc.in, with INCLUDEDIR, LIBDIR and
# DATADIR as ways from the file itself.
function(bushd_install_pkg_config file)
  cmake_parse_arguments(ARG "" "COMPONENT" "" ${ARGN})
  foreach(folder INCLUDEDIR LIBDIR DATADIR)
    file(RELATIVE_PATH way ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_FULL_${folder}})
    string(REGEX REPLACE "/$" "" way ${way})
    set(${folder} \${pcfiledir}/${way})
  endforeach()
  configure_file(${file}.in ${file} @ONLY)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/${file} DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig COMPONENT ${ARG_COMPONENT})
endfunction()

# bushd_install_unit(bushd.service DESTINATION lib/systemd/system COMPONENT bushd): from the template bushd.service.in, with BINDIR and
# LIBEXECDIR as absolute paths, as systemd wants them: so the file is written when it is installed.
function(bushd_install_unit file)
  cmake_parse_arguments(ARG "" "DESTINATION;COMPONENT" "" ${ARGN})
  set(code "set(unit \"${ARG_DESTINATION}/${file}\")\n")
  foreach(folder BINDIR LIBEXECDIR)
    string(APPEND code "set(${folder} \"${CMAKE_INSTALL_${folder}}\")\n")
  endforeach()
  string(APPEND code [[
foreach(path unit BINDIR LIBEXECDIR)
  cmake_path(ABSOLUTE_PATH ${path} BASE_DIRECTORY "${CMAKE_INSTALL_PREFIX}")
endforeach()
message(STATUS "Installing: $ENV{DESTDIR}${unit}")
list(APPEND CMAKE_INSTALL_MANIFEST_FILES "${unit}")
]])
  string(APPEND code "configure_file(\"${CMAKE_CURRENT_SOURCE_DIR}/${file}.in\" \"\$ENV{DESTDIR}\${unit}\" @ONLY NO_SOURCE_PERMISSIONS)\n")
  install(CODE "${code}" COMPONENT ${ARG_COMPONENT})
endfunction()

# bushd-epics: motor records of EPICS. It needs caproto, which Debian does not have; nothing else of bushd needs it. In the build tree it is
# beside the client, for tests; installed it has a folder of its own, where packages have caproto as well.
set(epics_package ${CMAKE_CURRENT_BINARY_DIR}/bushd_epics)
file(GLOB epics_modules CONFIGURE_DEPENDS ${CMAKE_CURRENT_SOURCE_DIR}/bushd_epics/*.py)
bushd_copies(epics_copies ${epics_package} ${epics_modules})
add_custom_target(bushd_epics ALL DEPENDS ${epics_copies})
add_dependencies(bushd_epics bushd_python)

install(FILES ${epics_modules} DESTINATION ${CMAKE_INSTALL_DATADIR}/bushd-epics/bushd_epics COMPONENT epics)
install(PROGRAMS bushd-epics DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT epics)
install(FILES ${PROJECT_SOURCE_DIR}/docs/man/bushd-epics.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 COMPONENT epics)

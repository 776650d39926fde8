# Installs further files (unit, manual pages, documents), and defines the Debian packages for `cpack -G DEB`. The root
# CMakeLists.txt includes it last, when all targets are known. See docs/operations.md, "The package".
include(GNUInstallDirs)
set(documents ${CMAKE_INSTALL_DATADIR}/doc/sonard)
set(made ${PROJECT_BINARY_DIR}/package)

# ---- the tools and the unit
install(TARGETS sonarctl RUNTIME COMPONENT sonard)
install(FILES daemon/systemd/sonard.service DESTINATION lib/systemd/system COMPONENT sonard)

# ---- manual pages, compressed for packages
find_program(SONAR_GZIP gzip)
foreach(page sonard.8 sonarctl.1 sonard.yaml.5)
  string(REGEX MATCH "[0-9]$" section ${page})
  if(SONAR_GZIP)
    add_custom_command(OUTPUT ${made}/${page}.gz
      COMMAND ${SONAR_GZIP} -9nc ${PROJECT_SOURCE_DIR}/docs/man/${page} > ${made}/${page}.gz
      DEPENDS docs/man/${page})
    list(APPEND pages ${made}/${page}.gz)
    install(FILES ${made}/${page}.gz DESTINATION ${CMAKE_INSTALL_MANDIR}/man${section} COMPONENT sonard)
  else()
    install(FILES docs/man/${page} DESTINATION ${CMAKE_INSTALL_MANDIR}/man${section} COMPONENT sonard)
  endif()
endforeach()

# ---- documents: the licence in Debian's form, the example configuration, and the pages to which errors and manuals refer
if(SONAR_FFTW)
  set(binaries_licence "GPL-3+")
  set(binaries_comment " These binaries are linked with FFTW, which is under the GPL-2 or later, so they may be passed on only
 under the terms of the GPL-3. The sources are under Apache-2.0; built with SONAR_FFTW=OFF, so are the binaries.")
else()
  set(binaries_licence "Apache-2.0")
  set(binaries_comment " Built without FFTW.")
endif()
configure_file(daemon/debian/copyright.in ${made}/copyright @ONLY)
install(FILES ${made}/copyright DESTINATION ${documents} COMPONENT sonard)
install(FILES ${made}/copyright DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/sonard-bvtsdk COMPONENT bvtsdk)
install(FILES docs/bvtsdk.md docs/blueview.png DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/sonard-bvtsdk COMPONENT bvtsdk)
install(FILES clients/bvtsdk/README.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/sonard-bvtsdk COMPONENT bvtsdk)
install(FILES docs/protocols/blueview-link.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/sonard-bvtsdk/protocols COMPONENT bvtsdk)
file(GLOB configurations CONFIGURE_DEPENDS ${CMAKE_SOURCE_DIR}/scenes/sonard*.yaml)  # one for each make, and the suite
install(FILES ${configurations} DESTINATION ${documents}/examples COMPONENT sonard)
install(FILES README.md CONTRIBUTING.md LICENSE DESTINATION ${documents} COMPONENT sonard)
install(DIRECTORY tests/judge DESTINATION ${documents}/tests COMPONENT sonard PATTERN "__pycache__" EXCLUDE)  # examples of docs/judge.md
install(DIRECTORY docs/ DESTINATION ${documents}/docs COMPONENT sonard PATTERN "man" EXCLUDE PATTERN "__pycache__" EXCLUDE)
install(FILES protocol/oculus/README.md DESTINATION ${documents}/protocol/oculus COMPONENT sonard)
install(FILES protocol/aris/README.md DESTINATION ${documents}/protocol/aris COMPONENT sonard)
install(FILES protocol/waterlinked/README.md DESTINATION ${documents}/protocol/waterlinked COMPONENT sonard)
install(FILES protocol/dvl/README.md DESTINATION ${documents}/protocol/dvl COMPONENT sonard)
install(FILES protocol/m3/README.md DESTINATION ${documents}/protocol/m3 COMPONENT sonard)
install(FILES protocol/micron/README.md DESTINATION ${documents}/protocol/micron COMPONENT sonard)
install(FILES protocol/norbit/README.md DESTINATION ${documents}/protocol/norbit COMPONENT sonard)
install(FILES protocol/ping/README.md DESTINATION ${documents}/protocol/ping COMPONENT sonard)
install(FILES protocol/control/control.proto DESTINATION ${CMAKE_INSTALL_DATADIR}/sonard/protocol/control COMPONENT sonard)
# Other files that pages link to are installed below share/sonard. Symbolic links at their places in the source tree lead there.
# tests/acceptance/package_test.py follows every link.
function(sonar_install_link folder name target)
  file(MAKE_DIRECTORY ${made}/links)
  file(CREATE_LINK ${target} ${made}/links/${name} SYMBOLIC)
  install(FILES ${made}/links/${name} DESTINATION ${documents}${folder} COMPONENT sonard)
endfunction()
sonar_install_link("" clients ../../sonard)
sonar_install_link("" scenes ../../sonard/scenes)
sonar_install_link(/protocol control ../../../sonard/protocol/control)
configure_file(daemon/debian/changelog.in ${made}/changelog @ONLY)
if(SONAR_GZIP)
  add_custom_command(OUTPUT ${made}/changelog.gz
    COMMAND ${SONAR_GZIP} -9nc ${made}/changelog > ${made}/changelog.gz DEPENDS ${made}/changelog)
  set(changelogs CHANGELOG.md ${made}/changelog.gz)
  add_custom_target(package_documents ALL DEPENDS ${pages} ${made}/changelog.gz)
else()
  set(changelogs CHANGELOG.md ${made}/changelog)
endif()
install(FILES ${changelogs} DESTINATION ${documents} COMPONENT sonard)
install(FILES ${changelogs} DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/sonard-bvtsdk COMPONENT bvtsdk)

# Target of ./run.sh --package, which builds everything that is installed above.
add_custom_target(installed)
add_dependencies(installed sonard sonarctl bvtsdk3 bvtsdk3_colour_maps bvtsdk4 bvtsdk4_colour_maps)
if(SONAR_GZIP)
  add_dependencies(installed package_documents)
endif()

# ---- the packages: one with the daemon and its tools, one for building BlueView drivers
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME sonard)
set(CPACK_PACKAGE_VENDOR "sonard")
set(CPACK_PACKAGE_CONTACT "sonard maintainers <maintainers@sonard.invalid>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR})
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_COMPONENTS_ALL sonard bvtsdk)
set(CPACK_COMPONENTS_GROUPING ONE_PER_GROUP)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS OFF)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
if(CMAKE_CROSSCOMPILING AND CMAKE_SYSTEM_PROCESSOR STREQUAL "aarch64")
  set(CPACK_DEBIAN_PACKAGE_ARCHITECTURE arm64)  # otherwise the architecture of the build machine
endif()
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_SONARD_PACKAGE_NAME sonard)
set(CPACK_DEBIAN_SONARD_PACKAGE_SECTION net)
set(CPACK_DEBIAN_SONARD_PACKAGE_RECOMMENDS python3)  # for sonarctl judge and lab
set(CPACK_DEBIAN_SONARD_PACKAGE_SUGGESTS python3-numpy)
set(CPACK_DEBIAN_SONARD_PACKAGE_CONTROL_EXTRA
  "${PROJECT_SOURCE_DIR}/daemon/debian/postinst;${PROJECT_SOURCE_DIR}/daemon/debian/prerm;${PROJECT_SOURCE_DIR}/daemon/debian/postrm")
set(CPACK_COMPONENT_SONARD_DESCRIPTION "emulates imaging sonars on the network, from a 3D scene
sonard holds a 3D scene, receives the pose of a vehicle, computes the echoes
that a multibeam sonar would receive, and serves them as an Oculus, a BlueView
sonar, an ARIS, a Sonar 3D-15, a Ping360, a Surveyor, an Omniscan, a Ping1D,
an S500, a DVL, an M3, a Micron or a Norbit. Drivers written for the real
device connect unchanged. Drivers of BlueView sonars use sonard's libraries.
The package has sonarctl, which checks, displays and controls sonars, and a
systemd unit, which the installation does not start.")
set(CPACK_DEBIAN_BVTSDK_PACKAGE_NAME sonard-bvtsdk)
set(CPACK_DEBIAN_BVTSDK_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_BVTSDK_PACKAGE_SUGGESTS sonard)
set(CPACK_COMPONENT_BVTSDK_DESCRIPTION "libraries with the interface of the BlueView SDK, for sonard
Open drivers of BlueView sonars that are built with them run against sonard.
They cannot connect to a real sonar. Each of the two interfaces, 3.x and 4.x, has
a folder of its own, /usr/lib/sonard/bvt3 and bvt4: give it to CMake as
CMAKE_PREFIX_PATH.")
include(CPack)

# Checks the build requirements first, so that one message names all that are missing or too old, and the packages to install.
# The versions are those of Ubuntu 22.04, the oldest system on which the code was compiled. Folders that use a library search
# for it again.
set(found_wanting)
set(wanted_packages)

if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 11)
  list(APPEND found_wanting "g++ 11 or newer (this is ${CMAKE_CXX_COMPILER_VERSION}, another: -DCMAKE_CXX_COMPILER=g++-12)")
elseif(CMAKE_CXX_COMPILER_ID MATCHES "Clang" AND CMAKE_CXX_COMPILER_VERSION VERSION_LESS 14)
  list(APPEND found_wanting "Clang 14 or newer (this is ${CMAKE_CXX_COMPILER_VERSION}, another: -DCMAKE_CXX_COMPILER=clang++-14)")
endif()

# sonar_need(NAME VERSION PACKAGE [find_package arguments...]): requires a library with a CMake description.
macro(sonar_need name version package)
  find_package(${name} QUIET ${ARGN})
  if(NOT ${name}_FOUND)
    list(APPEND found_wanting "${name} ${version} or newer (not found)")
    list(APPEND wanted_packages ${package})
  elseif(DEFINED ${name}_VERSION AND ${name}_VERSION VERSION_LESS ${version})
    list(APPEND found_wanting "${name} ${version} or newer (${${name}_VERSION} was found)")
    list(APPEND wanted_packages ${package})
  endif()
endmacro()
# sonar_need_library(NAME LIBRARY HEADER PACKAGE): requires a library without a CMake description. Sets NAME_INCLUDE_DIR and
# NAME_LIBRARY.
macro(sonar_need_library name library header package)
  find_path(${name}_INCLUDE_DIR ${header})
  find_library(${name}_LIBRARY ${library})
  set(${name}_FOUND ON)
  if(NOT ${name}_INCLUDE_DIR OR NOT ${name}_LIBRARY)
    set(${name}_FOUND OFF)
    list(APPEND found_wanting "${library} (not found)")
    list(APPEND wanted_packages ${package})
  endif()
endmacro()
sonar_need(assimp 5.2 libassimp-dev)
sonar_need(Boost 1.74 libboost-dev CONFIG)
sonar_need(CLI11 2.1 libcli11-dev)
find_package(embree 4 QUIET)  # embree accepts only requests for its own major version; 3.12 accepts none without a version
if(NOT embree_FOUND)
  sonar_need(embree 3.12 libembree-dev 3)
endif()
sonar_need(nlohmann_json 3.10 nlohmann-json3-dev)
sonar_need(PNG 1.6 libpng-dev)
sonar_need(Protobuf 3.12 "libprotobuf-dev;protobuf-compiler")
sonar_need(spdlog 1.9 libspdlog-dev)
find_package(tinyxml2 QUIET)
if(NOT tinyxml2_FOUND)  # Ubuntu 22.04 has tinyxml2 without a CMake description
  sonar_need_library(TINYXML2 tinyxml2 tinyxml2.h libtinyxml2-dev)
  if(TINYXML2_FOUND)
    add_library(tinyxml2::tinyxml2 UNKNOWN IMPORTED)
    set_target_properties(tinyxml2::tinyxml2 PROPERTIES IMPORTED_LOCATION ${TINYXML2_LIBRARY}
      INTERFACE_INCLUDE_DIRECTORIES ${TINYXML2_INCLUDE_DIR})
  endif()
endif()
sonar_need(tl-expected 1.0 libexpected-dev)
sonar_need(yaml-cpp 0.7 libyaml-cpp-dev)
sonar_need(ZLIB 1.2 zlib1g-dev)
sonar_need_library(SNAPPY snappy snappy.h libsnappy-dev)  # docs/decisions/0021-snappy.md
if(SONAR_FFTW)  # docs/decisions/0006-fftw.md
  sonar_need_library(FFTW3 fftw3 fftw3.h libfftw3-dev)
endif()
if(BUILD_TESTING)
  sonar_need(GTest 1.11 "libgtest-dev;libgmock-dev")
  sonar_need(Eigen3 3.3 libeigen3-dev NO_MODULE)
endif()
# From version 22 on (4.22 in C++) Protobuf needs Abseil and lacks the log handler and the status that this code uses.
if(Protobuf_FOUND AND Protobuf_VERSION VERSION_GREATER_EQUAL 4)
  list(APPEND found_wanting "Protobuf before 22 (${Protobuf_VERSION} was found): name an older one with -DProtobuf_ROOT=FOLDER")
endif()

if(found_wanting)
  list(JOIN found_wanting "\n  " found_wanting)
  list(JOIN wanted_packages " " wanted_packages)
  if(wanted_packages)
    set(wanted_packages "\nInstall them (Debian 12, 13, Ubuntu 22.04, 24.04: apt-get install ${wanted_packages}) or name their\
 folders with -DCMAKE_PREFIX_PATH=FOLDER.")
  endif()
  message(FATAL_ERROR "sonard cannot be built with what is here. It needs\n  ${found_wanting}${wanted_packages}")
endif()

# The farm needs natsMsg_NakWithDelay of libnats 3.3, which Ubuntu 22.04 does not have.
set(NATS_FOUND OFF)
if(SONAR_FARM)
  find_path(NATS_INCLUDE_DIR nats/nats.h)
  find_library(NATS_LIBRARY nats)
  set(nats_version 3.3)  # for headers that do not contain their version
  if(NATS_INCLUDE_DIR AND EXISTS ${NATS_INCLUDE_DIR}/nats/version.h)
    file(STRINGS ${NATS_INCLUDE_DIR}/nats/version.h nats_version REGEX "define NATS_VERSION_STRING")
    string(REGEX MATCH "[0-9.]+" nats_version "${nats_version}")
  endif()
  if(NATS_INCLUDE_DIR AND NATS_LIBRARY AND NOT nats_version VERSION_LESS 3.3)
    set(NATS_FOUND ON)
  endif()
endif()
if(NOT NATS_FOUND)
  message(STATUS "sonard: built without the farm (sonard worker, sonarctl farm): install libnats-dev 3.3 or newer")
endif()

# SPDX-License-Identifier: MIT

# Ceres is compiled: the system's, or what Ceres_DIR names. Eigen, Boost.Math and xsimd are headers
# alone: the system's or, where it has none and pip builds, those of one version from their projects.
option(SYMKIN_FETCH_HEADERS "Download Eigen, Boost.Math and xsimd where they are missing" OFF)
include(FetchContent)

# Sets the variable `name` to the folder of a project's sources. They are not built: there is no
# such SOURCE_SUBDIR.
function(symkin_fetch name url sha256)
  message(STATUS "${name} is not installed; taking ${url}")
  FetchContent_Declare(
    symkin_${name}
    URL ${url}
    URL_HASH SHA256=${sha256}
    SOURCE_SUBDIR none
  )
  FetchContent_MakeAvailable(symkin_${name})
  set(${name} ${symkin_${name}_SOURCE_DIR} PARENT_SCOPE)
endfunction()

if(SYMKIN_FETCH_HEADERS)
  set(otherwise QUIET)
else()
  set(otherwise REQUIRED)
endif()
# By its own package's rule version 5 does not serve who asks for 3.4.
find_package(Eigen3 5 QUIET NO_MODULE)
if(NOT TARGET Eigen3::Eigen)
  find_package(Eigen3 3.4 ${otherwise} NO_MODULE)
endif()
find_package(Boost 1.74 ${otherwise})
find_package(Threads REQUIRED)
find_package(Ceres 2.1 QUIET)
if(NOT TARGET Ceres::ceres)
  message(
    FATAL_ERROR
      "Ceres 2.1 or newer was not found; install libceres-dev (Debian, Ubuntu), ceres-solver-devel "
      "(Fedora), ceres-solver (Homebrew, conda-forge, vcpkg), or set Ceres_DIR"
  )
endif()
# By its header, since its own package asks for libraries that it does not need.
find_path(XSIMD_INCLUDE_DIR xsimd/xsimd.hpp)
mark_as_advanced(XSIMD_INCLUDE_DIR)

if(NOT TARGET Eigen3::Eigen)
  symkin_fetch(
    eigen https://gitlab.com/libeigen/eigen/-/archive/3.4.0/eigen-3.4.0.tar.bz2
    b4c198460eba6f28d34894e3a5710998818515104d6e74e5cc331ce31e46e626
  )
  add_library(Eigen3::Eigen INTERFACE IMPORTED)
  target_include_directories(Eigen3::Eigen SYSTEM INTERFACE ${eigen})
endif()
if(NOT TARGET Boost::headers)
  symkin_fetch(
    boost https://github.com/boostorg/math/archive/refs/tags/boost-1.83.0.tar.gz
    53e5f7539a66899fe0fca3080405cbd5f7959da5394ec13664746741aece1705
  )
  add_library(Boost::headers INTERFACE IMPORTED)
  target_include_directories(Boost::headers SYSTEM INTERFACE ${boost}/include)
  target_compile_definitions(Boost::headers INTERFACE BOOST_MATH_STANDALONE)
endif()
if(NOT XSIMD_INCLUDE_DIR)
  if(NOT SYMKIN_FETCH_HEADERS)
    message(FATAL_ERROR "xsimd/xsimd.hpp was not found; install xsimd 8 or set XSIMD_INCLUDE_DIR")
  endif()
  symkin_fetch(
    xsimd https://github.com/xtensor-stack/xsimd/archive/8.1.0.tar.gz
    d52551360d37709675237d2a0418e28f70995b5b7cdad7c674626bcfbbf48328
  )
  set(XSIMD_INCLUDE_DIR ${xsimd}/include)
endif()
add_library(symkin_xsimd INTERFACE)
target_include_directories(symkin_xsimd SYSTEM INTERFACE ${XSIMD_INCLUDE_DIR})

# SPDX-License-Identifier: MIT
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(symkin_config_directory ${CMAKE_INSTALL_LIBDIR}/cmake/symkin)

install(
  TARGETS symkin symkin_design symkin_statistics symkin_support
  EXPORT symkin-targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development
  LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development NAMELINK_COMPONENT development
  RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT development
)
install(
  DIRECTORY cpp/symkin
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}
  COMPONENT development
  FILES_MATCHING
  PATTERN "*.hpp"
  PATTERN "detail" EXCLUDE
)
install(
  EXPORT symkin-targets
  NAMESPACE symkin::
  DESTINATION ${symkin_config_directory}
  COMPONENT development
)

configure_package_config_file(
  cmake/symkin-config.cmake.in ${PROJECT_BINARY_DIR}/symkin-config.cmake
  INSTALL_DESTINATION ${symkin_config_directory}
)
write_basic_package_version_file(
  ${PROJECT_BINARY_DIR}/symkin-config-version.cmake COMPATIBILITY SameMinorVersion
)
install(
  FILES ${PROJECT_BINARY_DIR}/symkin-config.cmake ${PROJECT_BINARY_DIR}/symkin-config-version.cmake
  DESTINATION ${symkin_config_directory}
  COMPONENT development
)

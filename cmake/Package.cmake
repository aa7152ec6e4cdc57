include(CMakePackageConfigHelpers)
configure_package_config_file(cmake/WaymarkConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/WaymarkConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Waymark)
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/WaymarkConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(EXPORT WaymarkTargets NAMESPACE Waymark:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Waymark COMPONENT development)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/WaymarkConfig.cmake ${CMAKE_CURRENT_BINARY_DIR}/WaymarkConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/Waymark COMPONENT development)

# SPDX-License-Identifier: BSD-3-Clause
# Install rules: headers, the CMake package and the pkg-config file. Nothing depends on the architecture, so all lies under include/ and share/.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

set(searvins_package_dir "${CMAKE_INSTALL_DATADIR}/cmake/searvins")
target_compile_options(searvins_embedded INTERFACE
  "$<INSTALL_INTERFACE:SHELL:-include \"$<INSTALL_PREFIX>/${searvins_package_dir}/embedded_eigen.hpp\">")
install(TARGETS searvins searvins_embedded EXPORT searvinsTargets FILE_SET HEADERS)
install(EXPORT searvinsTargets NAMESPACE searvins:: DESTINATION "${searvins_package_dir}")

configure_package_config_file("${PROJECT_SOURCE_DIR}/cmake/searvinsConfig.cmake.in" "${PROJECT_BINARY_DIR}/searvinsConfig.cmake"
  INSTALL_DESTINATION "${searvins_package_dir}")
# While the version is 0.x a minor release may break; ARCH_INDEPENDENT lets a 32-bit cross build accept a package installed from a 64-bit host.
write_basic_package_version_file("${PROJECT_BINARY_DIR}/searvinsConfigVersion.cmake" COMPATIBILITY SameMinorVersion ARCH_INDEPENDENT)
install(FILES "${PROJECT_BINARY_DIR}/searvinsConfig.cmake" "${PROJECT_BINARY_DIR}/searvinsConfigVersion.cmake"
  "${PROJECT_SOURCE_DIR}/cmake/embedded_eigen.hpp" "${PROJECT_SOURCE_DIR}/cmake/instances.cmake" DESTINATION "${searvins_package_dir}")

configure_file("${PROJECT_SOURCE_DIR}/cmake/searvins.pc.in" "${PROJECT_BINARY_DIR}/searvins.pc" @ONLY)
install(FILES "${PROJECT_BINARY_DIR}/searvins.pc" DESTINATION "${CMAKE_INSTALL_DATADIR}/pkgconfig")
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" DESTINATION "${CMAKE_INSTALL_DOCDIR}")

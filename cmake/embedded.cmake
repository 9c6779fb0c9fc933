# SPDX-License-Identifier: BSD-3-Clause
# searvins::embedded: searvins::searvins with Eigen set up for bare metal (embedded_eigen.hpp, included by force). It changes the layout of
# Eigen's
# types, so link it to every target of an image, or to none.
add_library(searvins_embedded INTERFACE)
add_library(searvins::embedded ALIAS searvins_embedded)
set_target_properties(searvins_embedded PROPERTIES EXPORT_NAME embedded)
target_link_libraries(searvins_embedded INTERFACE searvins)
target_compile_options(searvins_embedded INTERFACE "$<BUILD_INTERFACE:SHELL:-include \"${CMAKE_CURRENT_LIST_DIR}/embedded_eigen.hpp\">")

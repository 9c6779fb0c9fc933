# SPDX-License-Identifier: BSD-3-Clause
# Target `docs`: the reference by Doxygen, in docs/html of the build folder. There when Doxygen is; no part of `all`.
find_program(DOXYGEN_EXECUTABLE doxygen)
if(DOXYGEN_EXECUTABLE)
  add_custom_target(docs COMMAND bash "${PROJECT_SOURCE_DIR}/docs/make_reference.sh" "${PROJECT_BINARY_DIR}/docs" USES_TERMINAL VERBATIM)
endif()

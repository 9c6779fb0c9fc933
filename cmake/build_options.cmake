# SPDX-License-Identifier: BSD-3-Clause
# searvins_build_options: what the project's own executables are compiled with. Never linked by searvins::searvins, never installed.
add_library(searvins_build_options INTERFACE)
target_compile_options(searvins_build_options INTERFACE
  -Wall -Wextra -Wconversion -Wsign-conversion -Wshadow -Wpedantic
  $<$<CXX_COMPILER_ID:GNU>:-Wdouble-promotion>  # float to double; clang++ would also refuse the tests' long double truth
  # g++ 12 sees overlap in std::string (GCC PR 105651) and, at -O3, ends, dangling pointers and uninitialised elements of fixed arrays whose run-time size is smaller
  "$<$<AND:$<CXX_COMPILER_ID:GNU>,$<VERSION_LESS:$<CXX_COMPILER_VERSION>,13>>:-Wno-restrict;-Wno-array-bounds;-Wno-stringop-overflow;-Wno-maybe-uninitialized;-Wno-dangling-pointer>"
  # g++ collects its garbage from 128 MB on; waiting to 1 GB makes a test 10 to 25 % faster to compile (at most 1.3 GB) and changes no code
  "$<$<CXX_COMPILER_ID:GNU>:--param=ggc-min-heapsize=1000000;--param=ggc-min-expand=300>"
  $<$<BOOL:${SEARVINS_WERROR}>:-Werror>)
if(SEARVINS_SANITIZE)
  target_compile_options(searvins_build_options INTERFACE -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
  target_link_options(searvins_build_options INTERFACE -fsanitize=address,undefined)
endif()

# searvins_executable(NAME SOURCE...): an executable on the library; `#include "examples/..."` works from everywhere.
function(searvins_executable name)
  add_executable(${name} ${ARGN})
  target_link_libraries(${name} PRIVATE searvins::searvins searvins_build_options)
  target_include_directories(${name} PRIVATE "${PROJECT_SOURCE_DIR}")
  set_target_properties(${name} PROPERTIES CXX_EXTENSIONS OFF)
endfunction()

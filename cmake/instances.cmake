# SPDX-License-Identifier: BSD-3-Clause
# searvins_add_instances(NAME HEADERS <header>... TYPES <type>...)
#
# Compiles class templates once. Makes the static library NAME with explicit instantiations of TYPES, each from its own source file, and the
# header <NAME.hpp>, which includes HEADERS and declares the same types `extern template`: a file that includes it and links NAME does not
# instantiate them again. HEADERS are as in `#include <...>`, from searvins or from the caller's own include folders (add those to NAME by
# target_include_directories). Compile options that change layout (-march under Eigen's vector types, EIGEN_* macros) must be the same on both sides:
# set them on NAME as PUBLIC. docs/howto/compile_less.md has an example and what it saves.
function(searvins_add_instances name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "HEADERS;TYPES")
  if(NOT arg_HEADERS OR NOT arg_TYPES OR arg_UNPARSED_ARGUMENTS)
    message(FATAL_ERROR "searvins_add_instances(NAME HEADERS <header>... TYPES <type>...): headers and types are needed, and nothing else"
                        " (got: ${arg_UNPARSED_ARGUMENTS})")
  endif()
  set(folder "${CMAKE_CURRENT_BINARY_DIR}/${name}_instances")
  set(includes "")
  foreach(header IN LISTS arg_HEADERS)
    string(APPEND includes "#include <${header}>\n")
  endforeach()
  set(declarations "")
  foreach(type IN LISTS arg_TYPES)
    string(APPEND declarations "extern template class ${type};\n")
  endforeach()
  file(CONFIGURE OUTPUT "${folder}/${name}.hpp" @ONLY
    CONTENT "// Written by searvins_add_instances(): these types are compiled in ${name}.\n#pragma once\n\n@includes@\n@declarations@")
  set(sources "")
  foreach(type IN LISTS arg_TYPES)
    list(LENGTH sources number)
    set(source "${folder}/instance_${number}.cpp")
    file(CONFIGURE OUTPUT "${source}" @ONLY CONTENT "// Written by searvins_add_instances().\n@includes@\ntemplate class @type@;\n")
    list(APPEND sources "${source}")
  endforeach()
  add_library(${name} STATIC ${sources})
  target_link_libraries(${name} PUBLIC searvins::searvins)
  target_include_directories(${name} INTERFACE "${folder}")
endfunction()

# SPDX-License-Identifier: BSD-3-Clause
# Bare-metal Cortex-M by GNU's compiler (Debian: gcc-arm-none-eabi libnewlib-arm-none-eabi libstdc++-arm-none-eabi-newlib).
#   -DSEARVINS_CORE=m7    Cortex-M7, double-precision FPU (default)
#   -DSEARVINS_CORE=m7sp  Cortex-M7, single-precision FPU: double in software
#   -DSEARVINS_CORE=m4f   Cortex-M4F
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)  # there is nothing to link against yet
set(CMAKE_TRY_COMPILE_PLATFORM_VARIABLES SEARVINS_CORE)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)

set(SEARVINS_CORE m7 CACHE STRING "m7, m7sp or m4f")
set(searvins_machine mps2-an500)
if(SEARVINS_CORE STREQUAL "m7")
  set(searvins_core_flags "-mcpu=cortex-m7 -mfpu=fpv5-d16")
elseif(SEARVINS_CORE STREQUAL "m7sp")
  set(searvins_core_flags "-mcpu=cortex-m7 -mfpu=fpv5-sp-d16")
elseif(SEARVINS_CORE STREQUAL "m4f")
  set(searvins_core_flags "-mcpu=cortex-m4 -mfpu=fpv4-sp-d16")
  set(searvins_machine mps2-an386)
else()
  message(FATAL_ERROR "SEARVINS_CORE is m7, m7sp or m4f, not '${SEARVINS_CORE}'")
endif()
set(CMAKE_CXX_FLAGS_INIT "${searvins_core_flags} -mthumb -mfloat-abi=hard")

# ctest starts a simulator, one nanosecond an instruction.
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-system-arm -M ${searvins_machine} -display none -serial none -monitor none
  -icount shift=0 -semihosting-config enable=on,target=native -kernel)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)

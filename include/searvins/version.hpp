// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Version of the library. This file is the source of truth: CMake parses it, so `include/` alone can be copied into a firmware tree.
#pragma once

#define SEARVINS_VERSION_MAJOR 0
#define SEARVINS_VERSION_MINOR 1
#define SEARVINS_VERSION_PATCH 0

/// True when the library is at least the named version: `#if SEARVINS_VERSION_AT_LEAST(0, 1, 0)`.
#define SEARVINS_VERSION_AT_LEAST(major, minor, patch)                            \
  (SEARVINS_VERSION_MAJOR * 10000 + SEARVINS_VERSION_MINOR * 100 + SEARVINS_VERSION_PATCH >= \
   (major) * 10000 + (minor) * 100 + (patch))

namespace searvins {

/// "major.minor.patch".
inline constexpr const char* kVersionString = "0.1.0";

}  // namespace searvins

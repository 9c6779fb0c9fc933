// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Eigen for bare metal: no heap, no iostream, no padding for vector registers a core does not have.
///
/// These macros change the layout of Eigen's types. So every translation unit of an image must see the same ones, before its first Eigen
/// header, and
/// nothing that is linked with code from elsewhere may see them: `searvins::embedded` includes this file by force (-include) where it is
/// linked,
/// `searvins::searvins` never does. Without CMake: `-include .../embedded_eigen.hpp` on every command line of the image.
#pragma once

/// What happens when Eigen finds an index out of range, or wants heap: an undefined instruction, hence a fault. Define it to something
/// that reports.
#ifndef SEARVINS_TRAP
#define SEARVINS_TRAP(text) __builtin_trap()
#endif

#define eigen_assert(x) ((x) ? static_cast<void>(0) : SEARVINS_TRAP(#x))  // of its own, so that NDEBUG does not switch off the next line
#define EIGEN_NO_MALLOC                                                  // heap use fails an eigen_assert
#define EIGEN_ALLOCA __builtin_alloca  // newlib has no macro alloca: without this, temporaries of run-time size would come from malloc
#define EIGEN_STACK_ALLOCATION_LIMIT 0xFFFFFFFFU  // known to be larger at compile time: the branch with malloc is not even linked
#define EIGEN_MAX_STATIC_ALIGN_BYTES 0            // natural alignment: Cortex-M has no vector registers
#define EIGEN_DONT_PARALLELIZE
#define EIGEN_NO_IO  // <iostream> brings static constructors

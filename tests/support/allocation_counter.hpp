// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Counts heap allocations: include it in ONE translation unit of an executable (it replaces the global operator new, and wraps malloc where the
/// dynamic linker allows it), and compare `heap_allocations()` before and after.
///
/// Under a sanitizer malloc belongs to the sanitizer and is left alone; operator new is still counted. Eigen allocates by malloc, so a plain build
/// is the one that settles the claim.
#pragma once

#include <cstdlib>
#include <new>

#include "support/allocation_count.hpp"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SEARVINS_COUNT_MALLOC 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define SEARVINS_COUNT_MALLOC 0
#endif
#endif
#if !defined(SEARVINS_COUNT_MALLOC) && defined(__GLIBC__)
#define SEARVINS_COUNT_MALLOC 1
#elif !defined(SEARVINS_COUNT_MALLOC)
#define SEARVINS_COUNT_MALLOC 0
#endif

namespace searvins::test {
/// Whether malloc itself is counted, not only operator new.
inline constexpr bool counts_malloc = SEARVINS_COUNT_MALLOC != 0;
}  // namespace searvins::test

#if SEARVINS_COUNT_MALLOC
extern "C" {
void* __libc_malloc(std::size_t size);            // NOLINT: glibc's own entry points
void* __libc_calloc(std::size_t n, std::size_t size);
void* __libc_realloc(void* p, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
void* malloc(std::size_t size) noexcept {
  ++searvins::test::allocation_count;
  return __libc_malloc(size);
}
void* calloc(std::size_t n, std::size_t size) noexcept {
  ++searvins::test::allocation_count;
  return __libc_calloc(n, size);
}
void* realloc(void* p, std::size_t size) noexcept {
  ++searvins::test::allocation_count;
  return __libc_realloc(p, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) noexcept {
  ++searvins::test::allocation_count;
  return __libc_memalign(alignment, size);
}
}
#else
// Kept out of line: inlined into a caller, malloc/free look like a mismatched pair to the compiler.
[[gnu::noinline]] void* operator new(std::size_t size) {
  ++searvins::test::allocation_count;
  if (void* const p = std::malloc(size ? size : 1)) return p;
  std::abort();
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }
#endif

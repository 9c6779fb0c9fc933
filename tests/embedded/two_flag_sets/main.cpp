// SPDX-License-Identifier: BSD-3-Clause
// P21: code for two sets of machine flags in one program, over a boundary of plain C structs. Both sides see the same layout of every
// public type, and
// compute the same to rounding. Says that it skips on a processor without AVX2.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <iterator>

#include "embedded/two_flag_sets/boundary.h"

namespace {

int failures = 0;
void check(bool holds, const char* what) {
  if (holds) return;
  ++failures;
  std::printf("failed: %s\n", what);
}

bool close(const double* a, const double* b, int n, double tolerance) {
  for (int i = 0; i < n; ++i)
    if (!(std::abs(a[i] - b[i]) <= tolerance * (1 + std::abs(b[i])))) return false;
  return true;
}

void check_layouts() {
  static BoundaryLayout plain[kMaxBoundaryLayouts], avx2[kMaxBoundaryLayouts];
  const int n = boundary_layouts_plain(plain);
  check(n > 30 && n == boundary_layouts_avx2(avx2), "both sides list the public types");
  int same = 0;
  for (int k = 0; k < n; ++k) {
    const bool equal =
        std::strcmp(plain[k].name, avx2[k].name) == 0 && plain[k].size == avx2[k].size && plain[k].alignment == avx2[k].alignment;
    same += equal ? 1 : 0;
    if (!equal)
      std::printf("%s: %lu bytes aligned to %lu, with AVX2 %lu aligned to %lu\n", plain[k].name, plain[k].size, plain[k].alignment,
                  avx2[k].size, avx2[k].alignment);
    check(equal, "the layout does not follow the flags");
  }
  std::printf("%d of %d public types have one layout\n", same, n);
}

void check_motions() {
  static BoundaryReading readings[kBoundarySamples];
  for (int k = 0; k < kBoundarySamples; ++k) {
    const double t = 0.01 * k;
    readings[k] = {1'433'649'600'000'000'000LL + k * 10'000'000LL, {0.3 * t, -0.2, 0.5 - t}, {1 + t, -2 * t, 9.8}};
  }
  BoundaryMotion plain, avx2;
  boundary_motion_plain(readings, &plain);
  boundary_motion_avx2(readings, &avx2);
  check(plain.ok == 1 && avx2.ok == 1 && plain.dv_mps[2] > 5, "both sides integrate");
  check(close(plain.rotation_rad, avx2.rotation_rad, 3, 1e-13) && close(plain.dp_m, avx2.dp_m, 3, 1e-13) &&
            close(plain.dv_mps, avx2.dv_mps, 3, 1e-13) && close(plain.variances, avx2.variances, 9, 1e-13),
        "both sides find the same motion");
}

void check_ambiguities() {
  BoundaryAmbiguities plain{};
  for (int i = 0; i < kBoundaryAmbiguities; ++i) {
    plain.a_hat[i] = 10.0 * i + 0.17 * (i - 2);
    for (int j = 0; j < kBoundaryAmbiguities; ++j)
      plain.Q[i * kBoundaryAmbiguities + j] = 0.5 / (1 + std::abs(i - j)) + (i == j ? 0.02 : 0);
  }
  BoundaryAmbiguities avx2 = plain;
  boundary_ambiguities_plain(&plain);
  boundary_ambiguities_avx2(&avx2);
  check(plain.ok == 1 && avx2.ok == 1 && plain.squared_norm > 0, "both sides search");
  check(std::equal(std::begin(plain.integers), std::end(plain.integers), avx2.integers), "both sides find the same integers");
  check(close(&plain.squared_norm, &avx2.squared_norm, 1, 1e-10), "at the same distance");
}

}  // namespace

int main() {
  if (!__builtin_cpu_supports("avx2") || !__builtin_cpu_supports("fma")) {
    std::puts("SKIPPED: P21 two sets of machine flags: this processor has no AVX2");
    return 0;
  }
  check_layouts();
  check_motions();
  check_ambiguities();
  std::puts(failures == 0 ? "both sides agree" : "the sides differ");
  return failures == 0 ? 0 : 1;
}

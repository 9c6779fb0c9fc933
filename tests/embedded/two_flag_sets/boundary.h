/* SPDX-License-Identifier: BSD-3-Clause
 * The boundary between code of different machine flags: plain C, no type of Eigen or searvins in it. plain.cpp and avx2.cpp offer the
 * same three functions, with their name behind. */
#ifndef SEARVINS_TESTS_EMBEDDED_BOUNDARY_H
#define SEARVINS_TESTS_EMBEDDED_BOUNDARY_H

#ifdef __cplusplus
extern "C" {
#endif

enum { kMaxBoundaryLayouts = 64, kBoundarySamples = 101, kBoundaryAmbiguities = 6 };

/* Size and alignment of a public type as one translation unit sees it. */
struct BoundaryLayout {
  const char* name;
  unsigned long size, alignment;
};

struct BoundaryReading {
  long long time_ns;
  double gyro_b_radps[3], accel_b_mps2[3];
};

/* Readings in, motion out: log(dR), dp, dv and the diagonal of the covariance. */
struct BoundaryMotion {
  int ok;
  double rotation_rad[3], dp_m[3], dv_mps[3], variances[9];
};

/* A small integer least-squares problem and its answer. */
struct BoundaryAmbiguities {
  double a_hat[kBoundaryAmbiguities], Q[kBoundaryAmbiguities * kBoundaryAmbiguities];
  long long integers[kBoundaryAmbiguities];
  double squared_norm;
  int ok;
};

int boundary_layouts_plain(struct BoundaryLayout* out);
int boundary_layouts_avx2(struct BoundaryLayout* out);
void boundary_motion_plain(const struct BoundaryReading* readings, struct BoundaryMotion* out);
void boundary_motion_avx2(const struct BoundaryReading* readings, struct BoundaryMotion* out);
void boundary_ambiguities_plain(struct BoundaryAmbiguities* problem);
void boundary_ambiguities_avx2(struct BoundaryAmbiguities* problem);

#ifdef __cplusplus
}
#endif

#endif

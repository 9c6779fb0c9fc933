// SPDX-License-Identifier: BSD-3-Clause
// The side of the boundary that is compiled with -mavx2 -mfma.
#include "embedded/two_flag_sets/sides.hpp"

extern "C" {
int boundary_layouts_avx2(BoundaryLayout* out) { return layouts(out); }
void boundary_motion_avx2(const BoundaryReading* readings, BoundaryMotion* out) { motion(readings, out); }
void boundary_ambiguities_avx2(BoundaryAmbiguities* problem) { ambiguities(problem); }
}

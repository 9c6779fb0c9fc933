// SPDX-License-Identifier: BSD-3-Clause
// The side of the boundary that is compiled as everything else is.
#include "embedded/two_flag_sets/sides.hpp"

extern "C" {
int boundary_layouts_plain(BoundaryLayout* out) { return layouts(out); }
void boundary_motion_plain(const BoundaryReading* readings, BoundaryMotion* out) { motion(readings, out); }
void boundary_ambiguities_plain(BoundaryAmbiguities* problem) { ambiguities(problem); }
}

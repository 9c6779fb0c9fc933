// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What the paper reports, number by number: its tables "Sensor configurations and positioning performance on the evaluated TEX-CUP route"
/// (label tab:full_route_results) and "IAR-fixed solution summary" (label tab:rtk_fix_results). 4040 evaluation epochs at 1 Hz, TEX-CUP of
/// 2019-05-09, 18:09:40 to 19:16:59 UTC. They were measured on that recording: beside runs on another they are context, not competitors.
#pragma once

#include <array>

namespace searvins::examples {

/// A figure as printed. Figures beyond a bound are printed as the bound: >1e4.
struct PaperFigure {
  double value{0};
  bool is_above{false};
};

/// A row of the first table.
struct PaperPositionRow {
  const char* method;
  const char* gnss;    ///< r: rover only, r+b: rover and base; TC, LC: tightly, loosely coupled
  const char* vision;  ///< M: monocular, S: stereo, empty: none
  bool has_imu;
  /// Horizontal RMSE, maximum (m), below 1.0 m, below 1.5 m (%), P95 (m); 3-D RMSE, maximum, P95 (m); availability (%).
  std::array<PaperFigure, 9> figures;
};

inline constexpr std::array<PaperPositionRow, 11> kPaperPositions{{
    {"RTKLIB-EX", "r+b", "", false, {{{4.95}, {58.56}, {46.14}, {59.23}, {8.41}, {10.31}, {66.99}, {21.52}, {100.0}}}},
    {"GICI-RTK", "r+b", "", false, {{{4.69}, {177.00}, {77.60}, {87.43}, {5.70}, {7.25}, {265.26}, {8.64}, {96.7}}}},
    {"GICI-RRR", "TC, r+b", "M", true, {{{92.44}, {1122.59}, {48.54}, {55.97}, {140.57}, {92.99}, {1122.73}, {147.72}, {96.3}}}},
    {"VINS-Fusion", "LC", "S", true, {{{5.10}, {35.86}, {44.26}, {57.82}, {9.68}, {10.48}, {59.07}, {22.38}, {99.9}}}},
    {"IC-GVINS", "LC", "M", true, {{{7.68}, {30.47}, {9.16}, {14.31}, {21.95}, {8.10}, {30.47}, {21.97}, {37.2}}}},
    {"GVINS", "TC, r", "M", true, {{{436.70}, {1e4, true}, {22.48}, {39.33}, {28.76}, {4e4, true}, {2e5, true}, {75.42}, {90.7}}}},
    {"InGVIO", "TC, r", "M", true, {{{1e3, true}, {4e4, true}, {5.00}, {6.58}, {161.77}, {1e3, true}, {4e4, true}, {223.53}, {98.4}}}},
    {"OKVIS2-X", "LC", "S", true, {{{19.29}, {69.44}, {31.29}, {44.98}, {50.17}, {30.94}, {91.05}, {73.07}, {100.0}}}},
    {"SeA-RVINS (batch)", "TC, r+b", "S", true, {{{0.38}, {2.91}, {97.15}, {99.63}, {0.90}, {1.30}, {5.50}, {2.67}, {100.0}}}},
    {"SeA-RVINS (scalar)", "TC, r+b", "S", true, {{{0.39}, {1.63}, {97.00}, {99.98}, {0.86}, {1.73}, {5.85}, {3.37}, {100.0}}}},
    {"SeA-RVINS (latent)", "TC, r+b", "S", true, {{{0.39}, {1.60}, {96.16}, {99.90}, {0.90}, {1.41}, {4.04}, {3.01}, {100.0}}}},
}};

/// A row of the second table: epochs at which an accepted integer solution was applied, and their horizontal error.
struct PaperFixRow {
  const char* method;  ///< as in the first table
  int used_fix_epochs;
  double fix_rate_pct, below_0p5_pct;
  int from_0p5_epochs;  ///< with an error of 0.5 m or more
  double rmse_m, max_m;
};

inline constexpr std::array<PaperFixRow, 3> kPaperFixes{{
    {"SeA-RVINS (batch)", 1383, 34.23, 97.54, 34, 0.17, 0.98},
    {"SeA-RVINS (scalar)", 1915, 47.40, 93.99, 115, 0.20, 0.85},
    {"SeA-RVINS (latent)", 1842, 45.59, 99.35, 12, 0.15, 0.55},
}};

}  // namespace searvins::examples

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Degrees, which people and files use, and radians, which everything that computes uses. x_rad = x_deg * kRadPerDeg.
#pragma once

#include <numbers>

namespace searvins::examples {

inline constexpr double kRadPerDeg = std::numbers::pi / 180, kDegPerRad = 180 / std::numbers::pi;

}  // namespace searvins::examples

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Poses in the form of the TUM benchmark, which most tools for trajectories read:
///
///     timestamp tx ty tz qx qy qz qw         seconds with nine decimals; the body in the world, p_w = R_wb p_b + t
#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>

#include <string>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/io/text_fields.hpp>

#include "examples/support/trajectory_alignment.hpp"

namespace searvins::examples {

/// The file as text; `comment` becomes its first line. Stamps are written as they stand, to the nanosecond: a double would lose the last
/// two digits of Unix seconds.
[[nodiscard]] inline std::string tum_text(const std::vector<TimedPose>& poses, const std::string& comment) {
  std::string text = "# " + comment + "\n# timestamp tx ty tz qx qy qz qw\n";
  for (const TimedPose& x : poses) {
    const std::string fraction = std::to_string(x.time.ns % kNanosecondsPerSecond);
    text += std::to_string(x.time.ns / kNanosecondsPerSecond) + '.' + std::string(9 - fraction.size(), '0') + fraction;
    for (int i = 0; i < 3; ++i) io::append_fixed(text += ' ', x.p_w_m[i], 6);
    const Eigen::Quaterniond q{x.R_wb};
    for (const double c : {q.x(), q.y(), q.z(), q.w()}) io::append_fixed(text += ' ', c, 9);
    text += '\n';
  }
  return text;
}

}  // namespace searvins::examples

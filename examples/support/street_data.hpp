// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Lines of a map as the scripts of the pages take them: under the tracks, so that a track is seen in its street.
#pragma once

#include <span>
#include <string>

#include <searvins/geodesy/local_frame.hpp>
#include <searvins/imu/centreline.hpp>
#include <searvins/io/text_fields.hpp>

namespace searvins::examples {

/// A member `,"streets":[{"e":[..],"n":[..]},..]` of a page's data, metres in the axes of `w`; empty without lines.
[[nodiscard]] inline std::string street_member(std::span<const imu::CentrelinePoint> points, const geodesy::LocalFrame& w) {
  if (points.empty()) return {};
  std::string text, east, north;
  const auto close = [&] {
    if (!east.empty()) text += (text.empty() ? "{\"e\":[" : ",{\"e\":[") + east + "],\"n\":[" + north + "]}";
    east.clear(), north.clear();
  };
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i > 0 && points[i].line != points[i - 1].line) close();
    const Eigen::Vector3d p_w_m = w.to_local(points[i].position_e_m);
    east += (east.empty() ? "" : ",") + io::fixed_text(p_w_m.x(), 1), north += (north.empty() ? "" : ",") + io::fixed_text(p_w_m.y(), 1);
  }
  close();
  return ",\"streets\":[" + text + ']';
}

}  // namespace searvins::examples

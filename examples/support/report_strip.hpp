// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The strip of frames in report.html: the pictures as data inside the page, each with what became of its observations, and one legend.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <string>
#include <string_view>
#include <vector>

#include <searvins/io/text_fields.hpp>
#include <searvins/vision/admission_report.hpp>

#include "examples/support/base64.hpp"
#include "examples/support/picture_marks.hpp"
#include "examples/support/png_writer.hpp"
#include "examples/support/strip_picture.hpp"

namespace searvins::examples {

namespace detail {

[[nodiscard]] inline std::string css_colour(Rgb c) {
  return "rgb(" + std::to_string(c.r) + ',' + std::to_string(c.g) + ',' + std::to_string(c.b) + ')';
}

/// A mark as the pictures have it, on their dark ground in light and dark pages alike.
[[nodiscard]] inline std::string mark_svg(MarkShape shape, Rgb colour) {
  std::string_view form = "<rect x=\"5.5\" y=\"5.5\" width=\"5\" height=\"5\" fill=\"";
  if (shape == MarkShape::ring) form = "<circle cx=\"8\" cy=\"8\" r=\"4.2\" fill=\"none\" stroke-width=\"1.8\" stroke=\"";
  if (shape == MarkShape::cross) form = "<path d=\"M4 4l8 8M12 4l-8 8\" stroke-width=\"2.2\" stroke=\"";
  return std::string{"<svg viewBox=\"0 0 16 16\" aria-hidden=\"true\"><rect width=\"16\" height=\"16\" rx=\"3\" fill=\"#20252b\"/>"}
      .append(form)
      .append(css_colour(colour))
      .append("\"/></svg>");
}

/// The ramp of ages.
[[nodiscard]] inline std::string age_ramp() {
  std::string stops;
  for (int age = 1; age <= kFullAge; age += (kFullAge - 1) / 6) stops += ',' + css_colour(colour_of_age(age));
  return "<span>" + mark_svg(MarkShape::ring, colour_of_age(kFullAge / 2)) +
         "admitted, seen in 1 <i style=\"background:linear-gradient(to right" + stops + ")\"></i> " + std::to_string(kFullAge) +
         " frames and more; the bar is its disparity</span>";
}

[[nodiscard]] inline std::string strip_legend(const std::vector<StripPicture>& pictures) {
  std::string text = "<div class=\"marks\">";
  for (std::size_t f = 0; f < vision::kObservationFates; ++f) {
    const auto fate = static_cast<vision::ObservationFate>(f);
    if (std::none_of(pictures.begin(), pictures.end(), [f](const StripPicture& p) { return p.counts[f] > 0; })) continue;
    text += fate == vision::ObservationFate::admitted
                ? age_ramp()
                : "<span>" + mark_svg(shape_of(fate), colour_of(fate)) + vision::name_of(fate) + "</span>";
  }
  if (std::any_of(pictures.begin(), pictures.end(), [](const StripPicture& p) { return p.unscreened > 0; }))
    text += "<span>" + mark_svg(MarkShape::dot, kUnscreenedColour) + "not screened</span>";
  return text + "</div>\n";
}

/// The reasons of a picture with how often they occur, most frequent first.
[[nodiscard]] inline std::string reasons_text(const StripPicture& picture) {
  std::array<std::size_t, vision::kObservationFates> order{};
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return picture.counts[a] > picture.counts[b]; });
  std::string text;
  for (const std::size_t f : order) {
    const auto fate = static_cast<vision::ObservationFate>(f);
    if (picture.counts[f] == 0 || fate == vision::ObservationFate::admitted) continue;
    text += (text.empty() ? "" : ", ") + std::string{vision::name_of(fate)} + "&nbsp;" + std::to_string(picture.counts[f]);
  }
  return text;
}

[[nodiscard]] inline std::string strip_figure(const StripPicture& picture) {
  const std::string offered = std::to_string(picture.offered());
  const std::string time = "sow " + io::fixed_text(picture.time.sow(), 2);
  const std::string fate = picture.fate ? vision::name_of(*picture.fate) : "not screened";
  const std::string count = picture.fate ? std::to_string(picture.admitted()) + " of " + offered + " admitted" : offered + " observations";
  std::string text = "<figure><img loading=\"lazy\" width=\"" + std::to_string(picture.image.width()) + "\" height=\"" +
                     std::to_string(picture.image.height()) + "\" alt=\"left picture at " + time + ": " + fate + ", " + count +
                     "\" src=\"data:image/png;base64," + base64(compact_png_of(picture.image)) + "\"><figcaption><b>" + time +
                     "</b><span>" + fate + "</span><span class=\"count\">" + count + "</span>";
  if (const std::string reasons = reasons_text(picture); !reasons.empty()) text += "<small>" + reasons + "</small>";
  return text + "</figcaption></figure>\n";
}

}  // namespace detail

/// The section of the page; empty when there are no pictures.
[[nodiscard]] inline std::string strip_section(const std::vector<StripPicture>& pictures) {
  if (pictures.empty()) return {};
  std::string text =
      "<section class=\"card\"><div class=\"head\"><h2>Frames</h2><span class=\"note\">left pictures of the run, with what became of the "
      "observations</span></div>\n" +
      detail::strip_legend(pictures) + "<div class=\"strip\">\n";
  for (const StripPicture& picture : pictures) text += detail::strip_figure(picture);
  return text + "</div></section>\n";
}

}  // namespace searvins::examples

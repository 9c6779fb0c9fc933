// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A small plot as SVG: axes with ticks and units, curves as points and lines with their names. Enough for docs/images/growth_*.svg.
///
///     Plot plot{"Update of the window", "window, s", "ms", Scale::linear, {{"smoother", {2, 4}, {1.9, 4.1}}}};
///     if (!write_svg("plot.svg", plot)) ...
///
/// Linear axes begin at zero; logarithmic ones, which take positive numbers only, end at the ticks around the data.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

namespace searvins::test {

enum class Scale { linear, logarithmic };

struct Curve {
  std::string name;
  std::vector<double> x, y;
};

struct Plot {
  std::string title, x_label, y_label;
  Scale scale{Scale::linear};  ///< of both axes
  std::vector<Curve> curves;
};

namespace detail {

/// From values to pixels of the picture.
struct Axis {
  Scale scale{Scale::linear};
  double low{0}, high{1}, from_px{0}, to_px{1};
  std::vector<double> ticks{};

  [[nodiscard]] double px(double value) const {
    const bool log = scale == Scale::logarithmic;
    const double part = log ? std::log(value / low) / std::log(high / low) : (value - low) / (high - low);
    return from_px + part * (to_px - from_px);
  }
};

/// 0, step, 2 step ... past the largest value, the step 1, 2 or 5 times a power of ten; about six of them.
inline void add_linear_ticks(Axis& axis, double largest) {
  const double power = std::pow(10.0, std::floor(std::log10(largest / 6)));
  double step = power;
  for (const double factor : {2.0, 5.0, 10.0})
    if (step * 7 < largest) step = factor * power;
  for (int i = 0; axis.ticks.empty() || axis.ticks.back() < largest; ++i) axis.ticks.push_back(i * step);
}

/// 1, 2 and 5 times powers of ten, from the one below the smallest value to the one above the largest.
inline void add_log_ticks(Axis& axis, double smallest, double largest) {
  for (int decade = static_cast<int>(std::floor(std::log10(smallest))); axis.ticks.empty() || axis.ticks.back() < largest; ++decade)
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double tick = factor * std::pow(10.0, decade);
      if (tick <= smallest) axis.ticks.clear();
      if (axis.ticks.empty() || axis.ticks.back() < largest) axis.ticks.push_back(tick);
    }
}

/// The axis that holds one member (x or y) of every curve.
inline Axis axis_of(const Plot& plot, std::vector<double> Curve::*member, double from_px, double to_px) {
  Axis axis{plot.scale, 0, 1, from_px, to_px, {}};
  double smallest = 1e300, largest = 0;
  for (const Curve& curve : plot.curves)
    for (const double value : curve.*member) smallest = std::min(smallest, value), largest = std::max(largest, value);
  if (plot.scale == Scale::linear)
    add_linear_ticks(axis, largest);
  else
    add_log_ticks(axis, smallest, largest);
  axis.low = axis.ticks.front(), axis.high = axis.ticks.back();
  return axis;
}

inline constexpr int kWidthPx = 700, kHeightPx = 450, kLeftPx = 70, kRightPx = 680, kTopPx = 45, kBottomPx = 390;

inline void write_axes(std::FILE* out, const Plot& plot, const Axis& x, const Axis& y) {
  for (const double tick : x.ticks)
    std::fprintf(out, "<path d='M%.1f %d V%d' stroke='#ddd'/><text x='%.1f' y='%d' text-anchor='middle'>%g</text>\n", x.px(tick), kBottomPx,
                 kTopPx, x.px(tick), kBottomPx + 20, tick);
  for (const double tick : y.ticks)
    std::fprintf(out, "<path d='M%d %.1f H%d' stroke='#ddd'/><text x='%d' y='%.1f' text-anchor='end'>%g</text>\n", kLeftPx, y.px(tick), kRightPx,
                 kLeftPx - 8, y.px(tick) + 5, tick);
  std::fprintf(out, "<path d='M%d %d V%d H%d' stroke='#333' fill='none'/>\n", kLeftPx, kTopPx, kBottomPx, kRightPx);
  std::fprintf(out, "<text x='%d' y='25' font-weight='bold'>%s</text>\n", kLeftPx, plot.title.c_str());
  std::fprintf(out, "<text x='%d' y='%d' text-anchor='middle'>%s</text>\n", (kLeftPx + kRightPx) / 2, kBottomPx + 45, plot.x_label.c_str());
  std::fprintf(out, "<text transform='translate(20 %d) rotate(-90)' text-anchor='middle'>%s</text>\n", (kTopPx + kBottomPx) / 2,
               plot.y_label.c_str());
}

inline void write_curve(std::FILE* out, const Curve& curve, const Axis& x, const Axis& y, std::size_t number) {
  static const char* const colours[] = {"#0b5fa5", "#c2571a", "#3a7d34"};
  const char* const colour = colours[number % 3];
  std::fprintf(out, "<polyline fill='none' stroke='%s' stroke-width='2' points='", colour);
  for (std::size_t i = 0; i < curve.x.size(); ++i) std::fprintf(out, "%.1f,%.1f ", x.px(curve.x[i]), y.px(curve.y[i]));
  std::fprintf(out, "'/>\n");
  for (std::size_t i = 0; i < curve.x.size(); ++i)
    std::fprintf(out, "<circle cx='%.1f' cy='%.1f' r='4' fill='%s'/>\n", x.px(curve.x[i]), y.px(curve.y[i]), colour);
  const double line_px = kTopPx + 20 + 20 * static_cast<double>(number);
  std::fprintf(out, "<circle cx='%d' cy='%.1f' r='4' fill='%s'/><text x='%d' y='%.1f'>%s</text>\n", kLeftPx + 20, line_px, colour, kLeftPx + 32,
               line_px + 5, curve.name.c_str());
}

}  // namespace detail

/// False when the file cannot be written, or there is nothing to show. Names and labels are written as they are: no `<` or `&`.
[[nodiscard]] inline bool write_svg(const std::string& file, const Plot& plot) {
  if (plot.curves.empty() || plot.curves.front().x.empty()) return false;
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> out(std::fopen(file.c_str(), "w"), &std::fclose);
  if (!out) return false;
  const detail::Axis x = detail::axis_of(plot, &Curve::x, detail::kLeftPx, detail::kRightPx);
  const detail::Axis y = detail::axis_of(plot, &Curve::y, detail::kBottomPx, detail::kTopPx);
  std::fprintf(out.get(), "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 %d %d' font-family='sans-serif' font-size='14' fill='#222'>\n",
               detail::kWidthPx, detail::kHeightPx);
  std::fprintf(out.get(), "<rect width='100%%' height='100%%' fill='white'/>\n");
  detail::write_axes(out.get(), plot, x, y);
  for (std::size_t i = 0; i < plot.curves.size(); ++i) detail::write_curve(out.get(), plot.curves[i], x, y, i);
  return std::fprintf(out.get(), "</svg>\n") > 0;
}

}  // namespace searvins::test

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Which parts of a view are not to be trusted because of what they show: what moves by itself (people, vehicles), what has no place
/// (sky) and what does not keep still (vegetation). [paper sec. Semantic-Aware Stereo Vision Frontend]
///
/// A SemanticMask gives the class of a pixel. A point is kept when no pixel of a rejected class lies within a margin of it: the erosion,
/// which is for the labels' own raggedness, plus a buffer that depends on the class, since the outline of a car is a corner for a
/// detector but moves with the car:
///
///     refused   if  |pixel - point| <= (erosion + buffer(class)) width / 2048     for a pixel of a rejected class
///
/// Margins are given for an image of 2048 px width and shrink or grow with it. A mask may be coarser than the image: LabelImage has its
/// own scale. Where the estimator has no labels, NoMask stands for them, and the frontend says the class of each observation
/// (StereoObservation::semantic_class) and, if it has the labels itself, whether the margin is violated (near_rejected_class).
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <concepts>
#include <cstddef>
#include <cstdint>
#include <initializer_list>

#include <searvins/vision/image_view.hpp>
#include <searvins/vision/stereo_observation.hpp>

namespace searvins::vision {

/// Classes of the Cityscapes benchmark by training number, what SegFormer and its like deliver.
enum class Cityscapes : SemanticClass {
  road = 0,
  sidewalk,
  building,
  wall,
  fence,
  pole,
  traffic_light,
  traffic_sign,
  vegetation,
  terrain,
  sky,
  person,
  rider,
  car,
  truck,
  bus,
  train,
  motorcycle,
  bicycle,
};

/// A set of classes.
class ClassSet {
 public:
  constexpr ClassSet() = default;
  constexpr ClassSet(std::initializer_list<SemanticClass> classes) {
    for (const SemanticClass c : classes) insert(c);
  }
  constexpr ClassSet(std::initializer_list<Cityscapes> classes) {
    for (const Cityscapes c : classes) insert(static_cast<SemanticClass>(c));
  }

  constexpr void insert(SemanticClass c) { words_[c / 64U] |= std::uint64_t{1} << (c % 64U); }
  [[nodiscard]] constexpr bool contains(SemanticClass c) const { return ((words_[c / 64U] >> (c % 64U)) & 1U) != 0; }
  [[nodiscard]] constexpr bool empty() const { return (words_[0] | words_[1] | words_[2] | words_[3]) == 0; }

 private:
  std::array<std::uint64_t, 4> words_{};
};

/// People and vehicles.
[[nodiscard]] constexpr ClassSet cityscapes_dynamic() {
  return {Cityscapes::person, Cityscapes::rider, Cityscapes::car,        Cityscapes::truck,
          Cityscapes::bus,    Cityscapes::train, Cityscapes::motorcycle, Cityscapes::bicycle};
}
/// Sky and vegetation: nothing there stays where it is.
[[nodiscard]] constexpr ClassSet cityscapes_unstable() { return {Cityscapes::sky, Cityscapes::vegetation}; }

/// What a class tells: the classes of a picture by pixel, of the size of the rectified image.
///
///     covers(u, v)          whether the picture knows about a point (px of the image)
///     semantic_class(u, v)  class there; kUnlabelled where it does not know
///     any_within(...)       whether a pixel of a set lies within a radius of a point
template <class M>
concept SemanticMask = requires(const M& mask, double px, const ClassSet& classes) {
  { mask.covers(px, px) } -> std::same_as<bool>;
  { mask.semantic_class(px, px) } -> std::same_as<SemanticClass>;
  { mask.any_within(px, px, px, classes) } -> std::same_as<bool>;
};

/// No picture: nothing is known, nothing is refused.
struct NoMask {
  [[nodiscard]] constexpr bool covers(double, double) const { return true; }
  [[nodiscard]] constexpr SemanticClass semantic_class(double, double) const { return kUnlabelled; }
  [[nodiscard]] constexpr bool any_within(double, double, double, const ClassSet&) const { return false; }
};

/// A picture of labels, one byte a pixel, possibly coarser than the image. Both cover the same area, so (u + 1/2, v + 1/2) scale - 1/2 is
/// where image pixel (u, v) lies in the labels.
struct LabelImage {
  ImageView labels;
  double scale{1};  ///< label pixels an image pixel, > 0: 0.25 for a network that works at a quarter of the resolution

  [[nodiscard]] bool covers(double u_px, double v_px) const {
    const double x = in_labels(u_px), y = in_labels(v_px);
    return labels.valid() && x >= -0.5 && y >= -0.5 && x < labels.width - 0.5 && y < labels.height - 0.5;
  }

  [[nodiscard]] SemanticClass semantic_class(double u_px, double v_px) const {
    return covers(u_px, v_px) ? labels(nearest(u_px), nearest(v_px)) : kUnlabelled;
  }

  /// Looks at the pixels whose centres lie within radius_px, and at the pixel that holds the point.
  [[nodiscard]] bool any_within(double u_px, double v_px, double radius_px, const ClassSet& classes) const {
    if (!covers(u_px, v_px)) return false;
    if (classes.contains(semantic_class(u_px, v_px))) return true;
    const double x = in_labels(u_px), y = in_labels(v_px), radius = radius_px * scale;
    const int top = static_cast<int>(std::ceil(std::max(y - radius, 0.0)));
    const int bottom = static_cast<int>(std::floor(std::min(y + radius, labels.height - 1.0)));
    for (int row = top; row <= bottom; ++row) {
      const double reach = std::sqrt(std::max(0.0, radius * radius - (row - y) * (row - y)));
      const int left = static_cast<int>(std::ceil(std::max(x - reach, 0.0)));
      const int right = static_cast<int>(std::floor(std::min(x + reach, labels.width - 1.0)));
      const std::uint8_t* const line = labels.row(row);
      for (int column = left; column <= right; ++column)
        if (classes.contains(line[column])) return true;
    }
    return false;
  }

 private:
  [[nodiscard]] double in_labels(double px) const { return (px + 0.5) * scale - 0.5; }
  [[nodiscard]] int nearest(double px) const { return static_cast<int>(std::floor(in_labels(px) + 0.5)); }
};
static_assert(SemanticMask<NoMask> && SemanticMask<LabelImage>);

/// What is rejected, and the margins, px at 2048 px width.
struct SemanticRules {
  ClassSet dynamic{cityscapes_dynamic()}, unstable{cityscapes_unstable()};
  double erosion_px{5};          ///< of what is accepted
  double dynamic_buffer_px{15};  ///< around what moves
  double unstable_buffer_px{5};  ///< around sky and vegetation

  [[nodiscard]] constexpr bool rejects(SemanticClass c) const { return dynamic.contains(c) || unstable.contains(c); }
};

/// Verdict on one point.
enum class SemanticVerdict : std::uint8_t { clear, rejected_class, near_boundary };

/// Screens a point (px) of an image of `width_px`. A point outside the mask is near its boundary: nothing is known of what surrounds it.
template <SemanticMask M>
[[nodiscard]] SemanticVerdict screen(const SemanticRules& rules, const M& mask, double u_px, double v_px, int width_px) {
  if (!mask.covers(u_px, v_px)) return SemanticVerdict::near_boundary;
  if (rules.rejects(mask.semantic_class(u_px, v_px))) return SemanticVerdict::rejected_class;
  const double size = width_px / 2048.0;
  if (mask.any_within(u_px, v_px, (rules.erosion_px + rules.dynamic_buffer_px) * size, rules.dynamic))
    return SemanticVerdict::near_boundary;
  if (mask.any_within(u_px, v_px, (rules.erosion_px + rules.unstable_buffer_px) * size, rules.unstable))
    return SemanticVerdict::near_boundary;
  return SemanticVerdict::clear;
}

}  // namespace searvins::vision

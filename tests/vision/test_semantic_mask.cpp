// SPDX-License-Identifier: BSD-3-Clause
#include <searvins/vision/semantic_mask.hpp>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <set>
#include <vector>

#include "support/property.hpp"

using namespace searvins::test;
using namespace searvins::vision;

namespace {

/// Labels in memory.
struct Labels {
  int width, height;
  std::vector<std::uint8_t> classes;

  Labels(int w, int h) : width(w), height(h), classes(static_cast<std::size_t>(w) * static_cast<std::size_t>(h), 0) {}
  std::uint8_t& at(int x, int y) {
    return classes[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)];
  }
  [[nodiscard]] LabelImage image(double scale = 1) const { return {packed_image(classes.data(), width, height), scale}; }
};

constexpr auto kCar = static_cast<SemanticClass>(Cityscapes::car);
constexpr auto kSky = static_cast<SemanticClass>(Cityscapes::sky);

}  // namespace

TEST_CASE("a set of classes is a set") {
  for_all_seeds(20, [](Rng& rng) {
    ClassSet classes;
    std::set<int> model;
    CHECK(classes.empty());
    for (int i = 0; i < 40; ++i) {
      const int c = integer(rng, 0, 255);
      classes.insert(static_cast<SemanticClass>(c));
      model.insert(c);
    }
    for (int c = 0; c < 256; ++c) CHECK(classes.contains(static_cast<SemanticClass>(c)) == (model.count(c) > 0));
    CHECK_FALSE(classes.empty());
  });
}

TEST_CASE("rejected by default: what moves, sky and vegetation; no road, no building, nothing unlabelled") {
  const SemanticRules rules;
  for (const Cityscapes c : {Cityscapes::person, Cityscapes::rider, Cityscapes::car, Cityscapes::truck, Cityscapes::bus, Cityscapes::train,
                             Cityscapes::motorcycle, Cityscapes::bicycle, Cityscapes::sky, Cityscapes::vegetation})
    CHECK(rules.rejects(static_cast<SemanticClass>(c)));
  for (const Cityscapes c : {Cityscapes::road, Cityscapes::building, Cityscapes::pole, Cityscapes::traffic_sign, Cityscapes::terrain})
    CHECK_FALSE(rules.rejects(static_cast<SemanticClass>(c)));
  CHECK_FALSE(rules.rejects(kUnlabelled));
  CHECK(kCar == 13);  // the benchmark's numbers
  CHECK(kSky == 10);
}

TEST_CASE("the margin is a disc: refused exactly within its radius, at any scale of the labels") {
  for_all_seeds(60, [](Rng& rng) {
    Labels labels(64, 48);
    const int x = integer(rng, 0, 63), y = integer(rng, 0, 47);
    labels.at(x, y) = kCar;
    const double scale = chance(rng, 0.5) ? 1.0 : 0.25;
    const double radius = uniform(rng, 0, 20) / scale;
    for (int trial = 0; trial < 60; ++trial) {
      const double lx = uniform(rng, 0, 63), ly = uniform(rng, 0, 47);
      const double u = (lx + 0.5) / scale - 0.5, v = (ly + 0.5) / scale - 0.5;
      const double distance = std::hypot(lx - x, ly - y) / scale;
      const bool holds_point = std::floor(lx + 0.5) == x && std::floor(ly + 0.5) == y;
      if (std::abs(distance - radius) < 1e-9) continue;
      CHECK(labels.image(scale).any_within(u, v, radius, ClassSet{kCar}) == (distance <= radius || holds_point));
      CHECK_FALSE(labels.image(scale).any_within(u, v, radius, ClassSet{kSky}));
    }
  });
}

TEST_CASE("verdicts: on the class, near it by the margin of its kind, clear") {
  Labels labels(2048, 60);
  for (int y = 0; y < 60; ++y) {
    for (int x = 100; x < 150; ++x) labels.at(x, y) = kCar;
    for (int x = 500; x < 550; ++x) labels.at(x, y) = kSky;
  }
  const SemanticRules rules;
  const auto verdict = [&](double u) { return screen(rules, labels.image(), u, 30, 2048); };
  CHECK(verdict(120) == SemanticVerdict::rejected_class);
  CHECK(verdict(149.4) == SemanticVerdict::rejected_class);
  CHECK(verdict(168.9) == SemanticVerdict::near_boundary);  // 149 + 5 + 15
  CHECK(verdict(169.1) == SemanticVerdict::clear);
  CHECK(verdict(80.1) == SemanticVerdict::near_boundary);
  CHECK(verdict(79.9) == SemanticVerdict::clear);
  CHECK(verdict(558.9) == SemanticVerdict::near_boundary);  // 549 + 5 + 5
  CHECK(verdict(559.1) == SemanticVerdict::clear);
  CHECK(screen(rules, labels.image(), 158, 30, 1024) == SemanticVerdict::near_boundary);  // half the width, half the margin
  CHECK(screen(rules, labels.image(), 160, 30, 1024) == SemanticVerdict::clear);
}

TEST_CASE("a point outside the labels, or nowhere, is near their boundary; without labels everything is clear") {
  const Labels labels(20, 10);
  const SemanticRules rules;
  CHECK(screen(rules, labels.image(), 5, 5, 20) == SemanticVerdict::clear);
  CHECK(screen(rules, labels.image(), -1, 5, 20) == SemanticVerdict::near_boundary);
  CHECK(screen(rules, labels.image(), 5, 10, 20) == SemanticVerdict::near_boundary);
  CHECK(screen(rules, labels.image(), std::numeric_limits<double>::quiet_NaN(), 5, 20) == SemanticVerdict::near_boundary);
  CHECK(screen(rules, LabelImage{}, 5, 5, 20) == SemanticVerdict::near_boundary);
  CHECK(labels.image().semantic_class(30, 5) == kUnlabelled);
  CHECK(screen(rules, NoMask{}, 1e9, -1e9, 20) == SemanticVerdict::clear);
}

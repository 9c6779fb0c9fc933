// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The annotated picture: every feature is marked, in the colour of its age or of the reason why it is none.
#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <optional>

#include "examples/orb_frontend/annotate.hpp"
#include "examples/synthetic_texture.hpp"

using namespace searvins;

TEST_CASE("Colours: young is blue, old is yellow, reasons differ") {
  CHECK(examples::colour_of_age(1) == examples::Rgb{70, 110, 255});
  CHECK(examples::colour_of_age(0) == examples::colour_of_age(1));
  CHECK(examples::colour_of_age(examples::kFullAge) == examples::Rgb{255, 225, 40});
  CHECK(examples::colour_of_age(1000) == examples::colour_of_age(examples::kFullAge));
  for (std::size_t a = 0; a < orb::kMatchFates; ++a)
    for (std::size_t b = 0; b < a; ++b)
      CHECK_FALSE(orb::colour_of(static_cast<orb::MatchFate>(a)) == orb::colour_of(static_cast<orb::MatchFate>(b)));
}

TEST_CASE("Every feature has its mark") {
  const vision::StereoCamera<double> camera = test::small_camera();
  const examples::GrayImage left = test::texture_image(test::Texture{3}, 320, 240),
                            right = test::texture_image(test::Texture{3}, 320, 240, 15);
  orb::OrbOptions options;
  options.extractor.features = 60;
  orb::OrbFrontend<128> frontend{camera, options};
  orb::OrbFrontend<128>::Frame frame;
  REQUIRE(frontend.process({left.view(), right.view(), {}, {}}, std::nullopt, frame).ok());
  const examples::RgbImage picture = orb::annotate(frontend, left.view());
  CHECK(picture.width() == 320);
  CHECK(picture.height() == 240 + orb::kLegendHeight);
  std::size_t marked = 0;
  for (std::size_t i = 0; i < frontend.features().size(); ++i) {
    const orb::Feature& f = frontend.features()[i];
    const bool is_followed = frontend.track_of_feature()[i] != 0;
    const examples::Rgb expected = is_followed ? examples::colour_of_age(1) : orb::colour_of(frontend.stereo_matches()[i].fate);
    const int x = static_cast<int>(std::lround(f.u_px)) - (is_followed ? 2 : 0), y = static_cast<int>(std::lround(f.v_px));
    marked += picture(x, y) == expected ? 1U : 0U;
  }
  CHECK(frontend.features().size() > 40);
  CHECK(marked * 10 >= frontend.features().size() * 9);  // marks of neighbours may lie over each other
}

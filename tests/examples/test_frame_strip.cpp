// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// The strip of frames: which frames are kept, what is drawn into them, and how the page shows them.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <limits>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "examples/support/base64.hpp"
#include "examples/support/frame_strip.hpp"
#include "examples/support/image_reader.hpp"
#include "examples/support/png_writer.hpp"
#include "examples/support/report.hpp"
#include "examples/support/report_strip.hpp"
#include "scored_run.hpp"
#include "support/property.hpp"

using namespace searvins;
using namespace searvins::examples;
using searvins::test::chance;
using searvins::test::for_all_seeds;
using searvins::test::integer;
using searvins::test::kStart;
using searvins::test::Rng;
using vision::FrameFate;
using vision::ObservationFate;
using Frame = vision::StereoFrame<64>;

namespace {


vision::StereoObservation at(std::uint64_t track, double u_px, double v_px, double disparity_px = 0) {
  vision::StereoObservation o;
  o.track = track, o.pixel_px = {u_px, u_px - disparity_px, v_px};
  return o;
}

/// Offers a frame of one observation.
void offer_one(FrameStrip& strip, GpsTime t, const GrayImage& image, const vision::StereoObservation& o) {
  Frame frame;
  frame.time = t;
  frame.add(o);
  strip.offer(t, image.view(), frame);
}

void judge_one(FrameStrip& strip, GpsTime t, ObservationFate fate) { strip.judge(t, std::array{fate}, FrameFate::full); }

/// The picture of one observation at (80, 40) in a grey image of 120 x 90, of a track seen in `age` frames.
StripPicture picture_of(const ObservationFate* fate, int age = 1, double disparity_px = 0) {
  const GrayImage image(120, 90, 100);
  FrameStrip strip{kStart, kStart.plus_seconds(100), {1, 960, 0.5}};
  for (int k = 0; k < age; ++k) offer_one(strip, kStart.plus_seconds(k), image, at(7, 80, 40, disparity_px));
  if (fate) judge_one(strip, kStart.plus_seconds(age - 1), *fate);
  const std::vector<StripPicture> pictures = strip.pictures();
  REQUIRE(pictures.size() == 1);
  return pictures.front();
}

std::size_t occurrences(std::string_view text, std::string_view part) {
  std::size_t n = 0;
  for (std::size_t i = text.find(part); i != std::string_view::npos; i = text.find(part, i + part.size())) ++n;
  return n;
}

/// Base 64 read back, letter by letter; what is no letter ends it.
std::string from_base64(std::string_view text) {
  constexpr std::string_view kLetters = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  std::uint32_t bits = 0;
  int held = 0;
  for (const char c : text) {
    const std::size_t value = kLetters.find(c);
    if (value == std::string_view::npos) break;
    bits = (bits << 6U | static_cast<std::uint32_t>(value)) & 0xFFFFU, held += 6;
    if (held < 8) continue;
    held -= 8;
    bytes += static_cast<char>(bits >> held & 0xFFU);
  }
  return bytes;
}

}  // namespace

TEST_CASE("base64: the examples of RFC 4648, and everything is read again") {
  CHECK(base64("").empty());
  CHECK(base64("f") == "Zg==");
  CHECK(base64("fo") == "Zm8=");
  CHECK(base64("foo") == "Zm9v");
  CHECK(base64("foobar") == "Zm9vYmFy");
  CHECK(base64(std::string_view{"\xff\xfe\xfd", 3}) == "//79");
  for_all_seeds(300, [](Rng& rng) {
    std::string bytes(static_cast<std::size_t>(integer(rng, 0, 100)), '\0');
    for (char& c : bytes) c = static_cast<char>(integer(rng, 0, 255));
    const std::string text = base64(bytes);
    CHECK(text.size() == (bytes.size() + 2) / 3 * 4);
    CHECK(from_base64(text) == bytes);
  });
}

TEST_CASE("PNG with numbered colours: colours and numbers are those of the picture; too many colours give a plain one") {
  for_all_seeds(60, [](Rng& rng) {
    RgbImage image(integer(rng, 1, 40), integer(rng, 1, 40));
    const int colours = integer(rng, 1, 400);
    std::set<std::array<int, 3>> used;
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x) {
        const int k = integer(rng, 0, colours - 1);
        const Rgb c = k % 3 ? Rgb{static_cast<std::uint8_t>(k / 3), static_cast<std::uint8_t>(k / 3), static_cast<std::uint8_t>(k / 3)}
                            : Rgb{static_cast<std::uint8_t>(k % 256), static_cast<std::uint8_t>(k / 2), 7};
        image.set(x, y, c), used.insert({c.r, c.g, c.b});
      }
    const std::string file = compact_png_of(image);
    const std::size_t palette = file.find("PLTE");
    CHECK((palette != std::string::npos) == (used.size() <= 256));
    const auto read = parse_image(file, "x.png");  // of a PNG with a palette: the numbers
    REQUIRE(read.ok());
    REQUIRE(read->width() == image.width());
    REQUIRE(read->height() == image.height());
    if (palette == std::string::npos) {
      CHECK(file == png_of(image));
      return;
    }
    bool is_same = true;
    for (int y = 0; y < image.height(); ++y)
      for (int x = 0; x < image.width(); ++x) {
        const auto part = [&](std::size_t k) { return static_cast<std::uint8_t>(file[palette + 4 + 3 * std::size_t{(*read)(x, y)} + k]); };
        is_same = is_same && Rgb{part(0), part(1), part(2)} == image(x, y);
      }
    CHECK(is_same);
  });
}

TEST_CASE("PNG with numbered colours: more than 256 colours") {
  RgbImage image(300, 1);
  for (int x = 0; x < 300; ++x) image.set(x, 0, {static_cast<std::uint8_t>(x % 256), static_cast<std::uint8_t>(x / 256), 0});
  CHECK(compact_png_of(image) == png_of(image));
  CHECK(compact_png_of(RgbImage{}).empty());
}

TEST_CASE("A smaller image: means of squares, what does not fill one is left out") {
  for_all_seeds(50, [](Rng& rng) {
    GrayImage image(integer(rng, 4, 30), integer(rng, 4, 30));
    for (std::uint8_t& p : image.pixels()) p = static_cast<std::uint8_t>(integer(rng, 0, 255));
    const int factor = integer(rng, 1, 4);
    const GrayImage small = reduced(image.view(), factor);
    REQUIRE(small.width() == image.width() / factor);
    REQUIRE(small.height() == image.height() / factor);
    const int x = integer(rng, 0, small.width() - 1), y = integer(rng, 0, small.height() - 1);
    double mean = 0;
    for (int i = 0; i < factor * factor; ++i) mean += image(x * factor + i % factor, y * factor + i / factor) / double(factor * factor);
    CHECK(std::abs(small(x, y) - mean) <= 0.5 + 1e-9);
  });
  CHECK(reduced({}, 2).empty());
  CHECK(reduced(GrayImage(4, 4).view(), 0).empty());
}

TEST_CASE("Frames are kept evenly over the run: the first of every stretch, whenever the judgement comes") {
  for_all_seeds(40, [](Rng& rng) {
    const GrayImage image(32, 24, 50);
    const int wanted = integer(rng, 1, 9), frames = integer(rng, 20, 200);
    const double step_s = 0.1, whole_s = step_s * frames;
    FrameStrip strip{kStart, kStart.plus_seconds(whole_s), {wanted, 960, 1.0}};
    const int late = integer(rng, 0, 4);  // frames by which judgements come later
    const auto time = [&](int k) { return kStart.plus_seconds(step_s * k); };
    for (int k = 0; k < frames + late; ++k) {
      if (k < frames) offer_one(strip, time(k), image, at(1, 10, 10));
      if (k >= late) judge_one(strip, time(k - late), ObservationFate::maturing);
    }
    const std::vector<StripPicture> pictures = strip.pictures();
    REQUIRE(pictures.size() == static_cast<std::size_t>(wanted));
    for (std::size_t i = 0; i < pictures.size(); ++i) {
      const double begin_s = whole_s * static_cast<double>(i) / wanted, after_s = seconds_between(kStart, pictures[i].time) - begin_s;
      CHECK(after_s > -1e-6);
      CHECK(after_s < step_s + 1e-6);
      CHECK(pictures[i].fate == FrameFate::full);
      CHECK(pictures[i].unscreened == 0);
    }
  });
}

TEST_CASE("A picture that is not judged gives way to a later one of its stretch; the last one stays, unscreened") {
  const GrayImage image(32, 24, 50);
  FrameStrip strip{kStart, kStart.plus_seconds(20), {2, 960, 1.0}};
  for (int k = 0; k < 200; ++k) {
    const GpsTime t = kStart.plus_seconds(0.1 * k);
    offer_one(strip, t, image, at(1, 10, 10));
    if (k >= 55 && k < 100) judge_one(strip, t, ObservationFate::maturing);
  }
  const std::vector<StripPicture> pictures = strip.pictures();
  REQUIRE(pictures.size() == 2);
  CHECK(pictures[0].fate == FrameFate::full);  // from 5.5 s on frames are screened
  CHECK(seconds_between(kStart, pictures[0].time) < 7);
  CHECK_FALSE(pictures[1].fate);
  CHECK(seconds_between(kStart, pictures[1].time) > 18.9);
  CHECK(pictures[1].unscreened == 1);
  CHECK(pictures[1].offered() == 1);
  CHECK(pictures[1].image(10, 10) == kUnscreenedColour);
}

TEST_CASE("Only the first judgement of a frame counts, and only that of a frame that is kept") {
  const GrayImage image(32, 24, 50);
  FrameStrip strip{kStart, kStart.plus_seconds(10), {1, 960, 100}};
  offer_one(strip, kStart, image, at(1, 10, 10));
  judge_one(strip, kStart.plus_seconds(1), ObservationFate::too_far);
  CHECK_FALSE(strip.pictures().front().fate);
  judge_one(strip, kStart, ObservationFate::low_score);
  judge_one(strip, kStart, ObservationFate::too_far);
  CHECK(strip.pictures().front().counts[static_cast<std::size_t>(ObservationFate::low_score)] == 1);
  CHECK(strip.pictures().front().offered() == 1);
}

TEST_CASE("Marks: a ring in the colour of the age and a bar as long as the disparity, else the colour of the reason") {
  const auto admitted = ObservationFate::admitted;
  for (const int age : {1, 4, 12, kFullAge, 40}) {
    const StripPicture picture = picture_of(&admitted, age, 20);
    const Rgb colour = colour_of_age(age);
    std::size_t on_ring = 0, on_bar = 0;
    for (int x = 81; x < 90; ++x) on_ring += picture.image(x, 40) == colour ? 1U : 0U;
    for (int x = 60; x < 80; ++x) on_bar += picture.image(x, 40) == colour ? 1U : 0U;
    CHECK(on_ring >= 1);
    CHECK(on_bar == 20);
    CHECK_FALSE(picture.image(59, 40) == colour);
    CHECK(picture.image(80, 60) == Rgb{50, 50, 50});  // dark elsewhere
    CHECK(picture.admitted() == 1);
  }
  for (std::size_t f = 1; f < vision::kObservationFates; ++f) {
    const auto fate = static_cast<ObservationFate>(f);
    const StripPicture picture = picture_of(&fate);
    CHECK(picture.image(80, 40) == colour_of(fate));
    CHECK((picture.image(83, 43) == colour_of(fate)) == (shape_of(fate) == MarkShape::cross));
    CHECK(picture.counts[f] == 1);
    CHECK(picture.admitted() == 0);
  }
  const StripPicture unscreened = picture_of(nullptr);
  CHECK(unscreened.image(80, 40) == kUnscreenedColour);
  CHECK_FALSE(unscreened.fate);
}

TEST_CASE("Colours: no two reasons look alike, nor like an age") {
  const auto distance = [](Rgb a, Rgb b) { return std::abs(a.r - b.r) + std::abs(a.g - b.g) + std::abs(a.b - b.b); };
  for (std::size_t f = 1; f < vision::kObservationFates; ++f) {
    const auto fate = static_cast<ObservationFate>(f);
    for (std::size_t g = 1; g < f; ++g)
      CHECK_MESSAGE(distance(colour_of(fate), colour_of(static_cast<ObservationFate>(g))) >= 50, vision::name_of(fate));
    CHECK(distance(colour_of(fate), kUnscreenedColour) >= 50);
    for (int age = 1; age <= kFullAge; ++age) CHECK_MESSAGE(distance(colour_of(fate), colour_of_age(age)) >= 50, vision::name_of(fate));
  }
}

TEST_CASE("Wide images become smaller by a whole factor, and the marks with them") {
  const GrayImage image(2048, 732, 120);
  FrameStrip strip{kStart, kStart.plus_seconds(1)};
  offer_one(strip, kStart, image, at(1, 1501, 301, 60));
  judge_one(strip, kStart, ObservationFate::low_score);
  const StripPicture picture = strip.pictures().front();
  CHECK(picture.image.width() == 682);
  CHECK(picture.image.height() == 244);
  CHECK(picture.image(500, 100) == colour_of(ObservationFate::low_score));  // (1501 + 0.5) / 3 - 0.5
}

TEST_CASE("Bad input: no image, no stretch, numbers that are none, more or fewer fates than observations") {
  const GrayImage image(32, 24, 50);
  Frame frame;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const double u : {nan, std::numeric_limits<double>::infinity(), 1e300, -1e9, 1e5, -5.0, 10.0}) frame.add(at(3, u, 10, 5));
  frame.add(at(4, 5, 5, -8)), frame.dropped = 2;
  const std::vector<ObservationFate> fates(20, ObservationFate::admitted);

  FrameStrip none{kStart, kStart.plus_seconds(1), {0}};
  none.offer(kStart, image.view(), frame);
  CHECK(none.pictures().empty());
  FrameStrip blind{kStart, kStart.plus_seconds(1)};
  blind.offer(kStart, {}, frame);
  blind.judge(kStart, fates, FrameFate::full);
  CHECK(blind.pictures().empty());

  FrameStrip strip{kStart, kStart};  // a run without length
  strip.offer(kStart, image.view(), frame);
  strip.judge(kStart, std::span{fates}.first(3), FrameFate::reuse_only);
  REQUIRE(strip.pictures().size() == 1);
  const StripPicture picture = strip.pictures().front();
  CHECK(picture.admitted() == 3);
  CHECK(picture.unscreened == frame.observations.size() - 3);
  CHECK(picture.counts[static_cast<std::size_t>(ObservationFate::capacity)] == 2);
  CHECK(picture.offered() == frame.observations.size() + 2);

  FrameStrip all{kStart, kStart};
  all.offer(kStart, image.view(), frame);
  all.judge(kStart, fates, FrameFate::full);
  CHECK(all.pictures().front().admitted() == frame.observations.size());
}

TEST_CASE("Ages are of frames: a number that occurs twice in a frame was seen once, one that was long away begins anew") {
  const GrayImage image(64, 48, 50);
  const auto admitted = ObservationFate::admitted;
  const auto age_after = [&](int away) {
    FrameStrip strip{kStart, kStart.plus_seconds(1000), {1, 960, 0.5}};
    int k = 0;
    for (; k < 5; ++k) {
      Frame frame;
      frame.add(at(9, 40, 20)), frame.add(at(9, 40, 20));
      strip.offer(kStart.plus_seconds(k), image.view(), frame);
    }
    for (; k < 5 + away; ++k) offer_one(strip, kStart.plus_seconds(k), image, at(100 + static_cast<std::uint64_t>(k), 5, 5));
    offer_one(strip, kStart.plus_seconds(k), image, at(9, 40, 20));
    judge_one(strip, kStart.plus_seconds(k), admitted);
    const StripPicture picture = strip.pictures().front();
    for (int age = 1; age < kFullAge; ++age)
      for (int x = 41; x < 48; ++x)
        if (picture.image(x, 20) == colour_of_age(age)) return age;
    return 0;
  };
  CHECK(age_after(0) == 6);
  CHECK(age_after(3) == 6);
  CHECK(age_after(200) == 1);
}

TEST_CASE("The section has a picture a frame, and a legend of the reasons that occur") {
  for_all_seeds(20, [](Rng& rng) {
    const GrayImage image(48, 32, 80);
    const int wanted = integer(rng, 1, 5);
    FrameStrip strip{kStart, kStart.plus_seconds(wanted), {wanted, 960, 10}};
    std::set<ObservationFate> occurring;
    bool is_unscreened = false;
    for (int k = 0; k < wanted; ++k) {
      const GpsTime t = kStart.plus_seconds(k);
      Frame frame;
      std::vector<ObservationFate> fates;
      for (int i = integer(rng, 1, 6); i > 0; --i) {
        frame.add(at(static_cast<std::uint64_t>(i), 8 * i, 16));
        fates.push_back(static_cast<ObservationFate>(integer(rng, 0, static_cast<int>(vision::kObservationFates) - 1)));
      }
      strip.offer(t, image.view(), frame);
      if (chance(rng, 0.2)) {
        is_unscreened = true;
        continue;
      }
      strip.judge(t, fates, FrameFate::full);
      occurring.insert(fates.begin(), fates.end());
    }
    const std::vector<StripPicture> pictures = strip.pictures();
    const std::string html = strip_section(pictures);
    CHECK(occurrences(html, "<img ") == static_cast<std::size_t>(wanted));
    CHECK(occurrences(html, "<section") == 1);
    CHECK(occurrences(html, "</section>") == 1);
    const std::size_t marks = html.find("<div class=\"marks\">");
    const std::string legend = html.substr(marks, html.find("<div class=\"strip\">") - marks);
    CHECK(occurrences(legend, "<svg ") == occurring.size() + (is_unscreened ? 1 : 0));
    for (std::size_t f = 0; f < vision::kObservationFates; ++f) {
      const auto fate = static_cast<ObservationFate>(f);
      const bool is_there = legend.find('>' + std::string{vision::name_of(fate)}) != std::string::npos;
      CHECK_MESSAGE(is_there == occurring.contains(fate), vision::name_of(fate));
    }
    CHECK((legend.find("not screened") != std::string::npos) == is_unscreened);
    const std::string_view begin = "data:image/png;base64,";
    const auto read = parse_image(from_base64(std::string_view{html}.substr(html.find(begin) + begin.size())), "x.png");
    REQUIRE(read.ok());
    CHECK(read->width() == 48);
    CHECK(html.find("sow 553980.00") != std::string::npos);
  });
  CHECK(strip_section({}).empty());
}

TEST_CASE("The page has the section where there are pictures, with rows or without") {
  const auto admitted = ObservationFate::admitted;
  RunReport report;
  CHECK(report_html(report).find("class=\"strip\"") == std::string::npos);
  report.strip.push_back(picture_of(&admitted));
  CHECK(occurrences(report_html(report), "<img ") == 1);
  io::TrajectoryRow row;
  row.time = kStart, row.p_e_m = {-3810234.401, 3567867.762, 3652897.917};
  report.rows.push_back(row);
  const std::string html = report_html(report);
  CHECK(occurrences(html, "<img ") == 1);
  CHECK(html.find("1 of 1 admitted") != std::string::npos);
}

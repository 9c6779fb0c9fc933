// SPDX-License-Identifier: BSD-3-Clause
// Model-based: random operations on a StaticVector and on a std::vector beside it must give the same content, step by step.
#include <doctest/doctest.h>

#include <algorithm>
#include <string>
#include <type_traits>
#include <vector>

#include <searvins/core/static_vector.hpp>

#include "support/property.hpp"

using searvins::StaticVector;
using searvins::test::integer;
using searvins::test::Rng;

namespace {

constexpr std::size_t kVectorCapacity = 7;
using Vector = StaticVector<int, kVectorCapacity>;

void check_same(const Vector& vector, const std::vector<int>& model) {
  REQUIRE(vector.size() == model.size());
  CHECK(std::equal(vector.begin(), vector.end(), model.begin()));
  CHECK(vector.empty() == model.empty());
  CHECK(vector.full() == (model.size() == kVectorCapacity));
  for (std::size_t i = vector.size(); i < kVectorCapacity; ++i) CHECK(vector.data()[i] == 0);  // past the end: default values
}

/// An element that owns something: counts how many live, and holds a value that only its default has.
struct Counted {
  inline static int alive = 0;
  std::string text{"default, and too long to be kept in place"};

  Counted() { ++alive; }
  Counted(const Counted& other) : text(other.text) { ++alive; }
  Counted& operator=(const Counted&) = default;
  ~Counted() { --alive; }
};

/// One random operation on both; whatever the vector refuses must leave it as it was.
void random_step(Rng& rng, Vector& vector, std::vector<int>& model) {
  const int value = integer(rng, 1, 1000);
  const auto place = static_cast<std::size_t>(integer(rng, 0, kVectorCapacity + 1));
  const bool fits = model.size() < kVectorCapacity;
  switch (integer(rng, 0, 7)) {
    case 0:
      CHECK(vector.push_back(value) == fits);
      if (fits) model.push_back(value);
      break;
    case 1: {
      int* added = vector.append();
      CHECK((added != nullptr) == fits);
      if (added) CHECK(*added == 0);
      if (fits) model.push_back(0);
      break;
    }
    case 2:
      vector.pop_back();
      if (!model.empty()) model.pop_back();
      break;
    case 3: {
      const bool valid = fits && place <= model.size();
      CHECK(vector.insert(place, value) == valid);
      if (valid) model.insert(model.begin() + static_cast<std::ptrdiff_t>(place), value);
      break;
    }
    case 4:
      vector.erase(place);
      if (place < model.size()) model.erase(model.begin() + static_cast<std::ptrdiff_t>(place));
      break;
    case 5: {
      const int divisor = integer(rng, 2, 4);
      const auto gone = [&](int x) { return x % divisor == 0; };
      CHECK(vector.erase_if(gone) == std::erase_if(model, gone));
      break;
    }
    case 6:
      CHECK(vector.resize(place) == (place <= kVectorCapacity));
      if (place <= kVectorCapacity) model.resize(place);
      break;
    default:
      if (integer(rng, 0, 9) == 0) {
        vector.clear();
        model.clear();
      }
  }
}

}  // namespace

TEST_CASE("StaticVector: random operations agree with std::vector, capacity included") {
  searvins::test::for_all_seeds(200, [](Rng& rng) {
    Vector vector;
    std::vector<int> model;
    for (int step = 0; step < 200; ++step) {
      CAPTURE(step);
      random_step(rng, vector, model);
      check_same(vector, model);
    }
    if (!model.empty()) {
      CHECK(vector.front() == model.front());
      CHECK(vector.back() == model.back());
      CHECK(vector[model.size() / 2] == model[model.size() / 2]);
    }
  });
}

TEST_CASE("StaticVector: an element of the vector itself may be inserted or appended") {
  searvins::test::for_all_seeds(200, [](Rng& rng) {
    Vector vector;
    std::vector<int> model;
    const int count = integer(rng, 1, kVectorCapacity - 2);
    for (int i = 0; i < count; ++i) {
      vector.push_back(i + 1);
      model.push_back(i + 1);
    }
    const auto source = static_cast<std::size_t>(integer(rng, 0, count - 1));
    const auto target = static_cast<std::size_t>(integer(rng, 0, count));
    const int value = model[source];
    CHECK(vector.insert(target, vector[source]));
    model.insert(model.begin() + static_cast<std::ptrdiff_t>(target), value);
    check_same(vector, model);
    CHECK(vector.push_back(vector.front()));
    model.push_back(model.front());
    check_same(vector, model);
  });
}

TEST_CASE("StaticVector: same content, same bytes, whatever the history") {
  Vector direct, roundabout;
  for (int i = 1; i <= 3; ++i) direct.push_back(i);
  for (int i = 1; i <= 7; ++i) roundabout.push_back(i * 10);
  roundabout.clear();
  for (int i = 0; i <= 4; ++i) roundabout.push_back(i);
  roundabout.erase(0);
  roundabout.erase(3);
  REQUIRE(roundabout.size() == direct.size());
  for (std::size_t i = 0; i < kVectorCapacity; ++i) CHECK(direct.data()[i] == roundabout.data()[i]);
}

TEST_CASE("StaticVector: elements that vanish are destroyed and made anew in place") {
  {
    StaticVector<Counted, 5> vector;
    searvins::test::for_all_seeds(100, [&](Rng& rng) {
      Counted mine;
      mine.text = std::to_string(integer(rng, 0, 999)) + ", neither the default nor short enough";
      static_cast<void>(vector.push_back(mine));
      static_cast<void>(vector.insert(static_cast<std::size_t>(integer(rng, 0, 5)), mine));
      if (integer(rng, 0, 1)) vector.erase(static_cast<std::size_t>(integer(rng, 0, 5)));
      if (integer(rng, 0, 3) == 0) vector.resize(static_cast<std::size_t>(integer(rng, 0, 5)));
      if (integer(rng, 0, 3) == 0) vector.pop_back();
      CHECK(Counted::alive == 5 + 1);
      for (std::size_t i = vector.size(); i < vector.capacity(); ++i) CHECK(vector.data()[i].text == Counted{}.text);
    });
  }
  CHECK(Counted::alive == 0);
}

TEST_CASE("StaticVector: usable at compile time, trivially copyable when its element is") {
  static_assert(std::is_trivially_copyable_v<Vector>);
  constexpr auto sum = [] {
    StaticVector<int, 4> v;
    for (int i = 0; i < 6; ++i) v.push_back(i);  // two are refused
    v.insert(0, 1);                              // refused
    v.erase(1);
    int total = 0;
    for (const int x : v) total += x;
    return total;
  }();
  static_assert(sum == 0 + 2 + 3);
  CHECK(Vector::capacity() == kVectorCapacity);
}

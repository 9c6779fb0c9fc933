// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Values of variables by key, for factors under test outside a smoother.
#pragma once

#include <doctest/doctest.h>

#include <cstdint>
#include <tuple>
#include <vector>

#include <searvins/smoother/variable.hpp>

namespace searvins::test {

/// One list a type of variable; a key names a place in its list.
template <class... Variables>
class FactorValuesOf {
 public:
  template <class V>
  smoother::Key<V> add(const V& value) {
    auto& list = std::get<std::vector<V>>(lists_);
    list.push_back(value);
    return {static_cast<std::uint32_t>(list.size() - 1), 1};
  }
  template <class V>
  [[nodiscard]] const V& operator()(const smoother::Key<V>& key) const {
    REQUIRE(key.valid());
    return std::get<std::vector<V>>(lists_).at(key.slot);
  }
  template <class V>
  [[nodiscard]] V& at(const smoother::Key<V>& key) {
    return std::get<std::vector<V>>(lists_).at(key.slot);
  }

 private:
  std::tuple<std::vector<Variables>...> lists_{};
};

}  // namespace searvins::test

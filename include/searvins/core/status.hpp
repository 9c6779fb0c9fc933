// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Errors as values: a Status says what is wrong and where, a Result<T> carries either a value or a Status.
///
/// The library throws nothing, aborts nothing and prints nothing. Whatever can fail returns one of these two, and both are
/// `[[nodiscard]]`. A Status holds no heap memory: its text is a string literal, its place two integers and a number.
#pragma once

#include <cstdint>
#include <type_traits>
#include <utility>

namespace searvins {

/// What went wrong. Each enumerator names its cause and what the caller can do.
enum class StatusCode : std::uint8_t {
  ok,                     ///< no error
  invalid_argument,       ///< a value outside its documented domain: correct it; nothing was changed
  non_finite,             ///< NaN or infinity in the input: drop the sample; nothing was changed
  out_of_order,           ///< time stamp before the last accepted one: sort the stream or raise the declared latency
  duplicate,              ///< time stamp or key that exists already: drop the sample
  capacity_exceeded,      ///< a compile-time capacity is full: the item was not taken; raise the capacity or offer less
  unknown_key,            ///< the key names nothing that lives now (stale generation): the caller kept a key too long
  not_positive_definite,  ///< a matrix that must be positive definite is not: `index` is the failing pivot
  under_determined,       ///< no information about a variable: `index` names it, `detail` its tangent axis
  not_converged,          ///< the iteration limit was reached, or no step decreased the cost: not a success
  no_data,                ///< nothing to work on (no observation, no ephemeris, no common satellite)
  too_few,                ///< fewer measurements than unknowns: `index` is what was there, `detail` what is needed
  stale,                  ///< data older than its allowed age
  unsupported,            ///< a well-formed input of a kind that is not handled
  rejected,               ///< a validation test refused the result; the previous state holds
};

/// Name of a status code, for messages.
[[nodiscard]] constexpr const char* name_of(StatusCode code) {
  switch (code) {
    case StatusCode::ok: return "ok";
    case StatusCode::invalid_argument: return "invalid argument";
    case StatusCode::non_finite: return "non-finite value";
    case StatusCode::out_of_order: return "out of order";
    case StatusCode::duplicate: return "duplicate";
    case StatusCode::capacity_exceeded: return "capacity exceeded";
    case StatusCode::unknown_key: return "unknown key";
    case StatusCode::not_positive_definite: return "not positive definite";
    case StatusCode::under_determined: return "under-determined";
    case StatusCode::not_converged: return "not converged";
    case StatusCode::no_data: return "no data";
    case StatusCode::too_few: return "too few measurements";
    case StatusCode::stale: return "stale";
    case StatusCode::unsupported: return "unsupported";
    case StatusCode::rejected: return "rejected";
  }
  return "unknown status";
}

/// Outcome of an operation.
struct [[nodiscard]] Status {
  StatusCode code{StatusCode::ok};
  const char* what{""};     ///< a string literal: what is wrong and what to do
  std::int32_t index{-1};   ///< where: element, pivot, variable slot ... as `what` says; -1 when there is no place
  std::int32_t detail{-1};  ///< a second place: axis, needed count ...; -1 when there is none
  double value{0};          ///< the offending number, 0 when there is none

  [[nodiscard]] constexpr bool ok() const { return code == StatusCode::ok; }
  constexpr explicit operator bool() const { return ok(); }
};

/// Success.
[[nodiscard]] constexpr Status ok_status() { return {}; }

/// A failure with its place.
[[nodiscard]] constexpr Status failure(StatusCode code, const char* what, std::int32_t index = -1, std::int32_t detail = -1, double value = 0) {
  return {code, what, index, detail, value};
}

/// Either a T or the Status that says why there is none. T must be default constructible (no heap, no union tricks: an embedded
/// debugger can read it). Reading `value()` of a failed Result gives a default T, never undefined behaviour.
template <class T>
class [[nodiscard]] Result {
 public:
  constexpr Result(T value) : value_(std::move(value)) {}          // NOLINT(google-explicit-constructor): return x; is the point
  constexpr Result(const Status& status) : status_(status) {       // NOLINT(google-explicit-constructor)
    if (status_.ok()) status_ = failure(StatusCode::invalid_argument, "Result built from an ok status without a value");
  }

  [[nodiscard]] constexpr bool ok() const { return status_.ok(); }
  constexpr explicit operator bool() const { return ok(); }
  [[nodiscard]] constexpr const Status& status() const { return status_; }
  [[nodiscard]] constexpr const T& value() const& { return value_; }
  [[nodiscard]] constexpr T& value() & { return value_; }
  [[nodiscard]] constexpr T value_or(T other) const { return ok() ? value_ : std::move(other); }
  constexpr const T& operator*() const { return value_; }
  constexpr T& operator*() { return value_; }
  constexpr const T* operator->() const { return &value_; }
  constexpr T* operator->() { return &value_; }

 private:
  T value_{};
  Status status_{};
};

}  // namespace searvins

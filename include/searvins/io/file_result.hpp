// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// A value read from a file, or the Diagnostic that says why there is none: for files that are either right as a whole or refused.
/// (What skips bad parts and goes on returns Parsed<T>, see diagnostic.hpp.)
#pragma once

#include <utility>

#include <searvins/io/diagnostic.hpp>

namespace searvins::io {

/// Either a T or a Diagnostic. Reading value() of a failed one gives a default T.
template <class T>
class [[nodiscard]] FileResult {
 public:
  FileResult(T value) : value_(std::move(value)), ok_(true) {}  // NOLINT(google-explicit-constructor): return x; is the point
  FileResult(Diagnostic error) : error_(std::move(error)) {}    // NOLINT(google-explicit-constructor)

  [[nodiscard]] bool ok() const { return ok_; }
  explicit operator bool() const { return ok_; }
  [[nodiscard]] const Diagnostic& error() const { return error_; }
  [[nodiscard]] const T& value() const& { return value_; }
  [[nodiscard]] T& value() & { return value_; }
  [[nodiscard]] T&& value() && { return std::move(value_); }
  const T& operator*() const { return value_; }
  T& operator*() { return value_; }
  const T* operator->() const { return &value_; }
  T* operator->() { return &value_; }

 private:
  T value_{};
  Diagnostic error_{};
  bool ok_{false};
};

}  // namespace searvins::io

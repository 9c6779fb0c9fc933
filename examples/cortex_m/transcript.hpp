// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// What a program computed, one number a line, for people and for compare.cpp:
///
///     name[3] = -12                                   an integer
///     name[3] = 0.123456789 3fbf9add3739635f bits     a real number that must be the same bits everywhere
///     name[3] = 0.123456789 3fbf9add3739635f 1e-12    one that may differ by 1e-12 (1 + |value|)
///     # anything                                      for people only: costs of one machine
///
/// The digits are for people; the hexadecimal word is the number. Written without printf, which would bring 20 kB and a heap.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>

#include "examples/cortex_m/board.hpp"

namespace searvins::cortex_m {

/// One line of text, built from the left; what does not fit is cut off.
class Line {
 public:
  Line& text(const char* s) {
    for (; *s != 0; ++s) put(*s);
    return *this;
  }
  Line& integer(std::int64_t value) {
    if (value < 0) put('-');
    return unsigned_integer(value < 0 ? 0 - static_cast<std::uint64_t>(value) : static_cast<std::uint64_t>(value), 1);
  }
  /// Nine decimals from 1e-3 to 1e12, else the exponent of ten is put behind.
  Line& real(double value) {
    if (!(value == value)) return text("nan");
    if (value < 0) put('-');
    double size = value < 0 ? -value : value;
    if (size > 1e300) return text("huge");
    int exponent = 0;
    while (size >= 1e12) size /= 10, ++exponent;
    if (size < 1e-3)
      while (size != 0 && size < 1 && exponent > -300) size *= 10, --exponent;
    auto whole = static_cast<std::uint64_t>(size);
    auto billionths = static_cast<std::uint64_t>((size - static_cast<double>(whole)) * 1e9 + 0.5);
    if (billionths == 1'000'000'000) billionths = 0, ++whole;
    unsigned_integer(whole, 1).put('.');
    unsigned_integer(billionths, 9);
    return exponent == 0 ? *this : text("e").integer(exponent);
  }
  Line& hexadecimal(std::uint64_t word) {
    for (int shift = 60; shift >= 0; shift -= 4) put("0123456789abcdef"[(word >> shift) & 15U]);
    return *this;
  }
  void end() {
    put('\n');
    buffer_[size_] = 0;
    write(buffer_);
    size_ = 0;
  }

 private:
  Line& put(char c) {
    if (size_ + 2 < sizeof buffer_ || (c == '\n' && size_ + 1 < sizeof buffer_)) buffer_[size_++] = c;
    return *this;
  }
  Line& unsigned_integer(std::uint64_t value, int least_digits) {
    char digits[20];
    int n = 0;
    do digits[n++] = static_cast<char>('0' + value % 10), value /= 10;
    while (value != 0);
    for (int k = n; k < least_digits; ++k) put('0');
    while (n > 0) put(digits[--n]);
    return *this;
  }

  char buffer_[160];
  std::size_t size_{0};
};

inline Line line_of(const char* name, int index) {
  Line line;
  line.text(name).text("[").integer(index).text("] = ");
  return line;
}

/// An integer: equal everywhere.
inline void report(const char* name, int index, std::int64_t value) { line_of(name, index).integer(value).end(); }

/// A real number whose way there asks nothing of the mathematical library: the same bits everywhere.
inline void report_bits(const char* name, int index, double value) {
  line_of(name, index).real(value).text(" ").hexadecimal(std::bit_cast<std::uint64_t>(value)).text(" bits").end();
}

/// A real number that may differ by 10^-digits (1 + |value|), since sin, cos, log, ... of two libraries differ in the last bit.
inline void report_close(const char* name, int index, double value, int digits) {
  line_of(name, index).real(value).text(" ").hexadecimal(std::bit_cast<std::uint64_t>(value)).text(" 1e-").integer(digits).end();
}

/// For people: a cost or size of this machine.
inline void remark(const char* name, std::int64_t value, const char* unit) {
  Line line;
  line.text("# ").text(name).text(": ").integer(value).text(" ").text(unit).end();
}

/// Ends a program: its stack and its verdict, which is the exit status.
inline int finish(bool passed) {
  remark("stack", stack_high_water(), "bytes at most");
  write(passed ? "# PASS\n" : "# FAIL\n");
  return passed ? 0 : 1;
}

}  // namespace searvins::cortex_m

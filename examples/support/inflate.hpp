// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Unpacks DEFLATE data (RFC 1951) in a zlib wrapper (RFC 1950), which is how PNG stores pixels.
///
/// The size of the result is known beforehand to every caller here, so the output is bounded: data that would unpack to more is refused, as
/// are codes that do not exist, distances before the beginning, data that end early and a wrong checksum.
///
/// A Huffman code is decoded by a table over its first kFastBits bits; longer codes, which are rare, go on bit by bit through the counts of
/// codes per length (canonical codes of one length are consecutive numbers).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#include "examples/support/checksums.hpp"

namespace searvins::examples {

namespace detail {

/// Bits from the lowest of each byte up. Beyond the end there are zeros, and overrun() says so.
class BitReader {
 public:
  explicit BitReader(std::span<const std::uint8_t> bytes) : bytes_(bytes) {}

  /// The next `count` (<= 32) bits without taking them.
  [[nodiscard]] std::uint32_t peek(unsigned count) {
    while (held_ < count) {
      const std::uint64_t byte = next_ < bytes_.size() ? bytes_[next_] : 0;
      ++next_;
      bits_ |= byte << held_;
      held_ += 8;
    }
    return static_cast<std::uint32_t>(bits_ & ((std::uint64_t{1} << count) - 1));
  }
  void drop(unsigned count) {
    bits_ >>= count;
    held_ -= count;
  }
  [[nodiscard]] std::uint32_t take(unsigned count) {
    const std::uint32_t value = peek(count);
    drop(count);
    return value;
  }
  /// Forgets the rest of the byte begun.
  void align() { drop(held_ % 8); }
  /// True when bits beyond the end were taken.
  [[nodiscard]] bool overrun() const { return next_ > bytes_.size() && (next_ - bytes_.size()) * 8 > held_; }

 private:
  std::span<const std::uint8_t> bytes_;
  std::size_t next_{0};
  std::uint64_t bits_{0};
  unsigned held_{0};
};

/// A canonical Huffman code of at most 288 symbols and 15 bits.
class HuffmanCode {
 public:
  static constexpr int kNoSymbol = -1;

  /// From the code length of every symbol (0: not used); false when the lengths need more codes than there are.
  [[nodiscard]] bool build(std::span<const std::uint8_t> lengths) {
    count_.fill(0);
    fast_.fill({});
    for (const std::uint8_t length : lengths) ++count_[length];
    count_[0] = 0;
    int free = 1;
    for (std::size_t length = 1; length <= kMaxBits; ++length) {
      free = 2 * free - count_[length];
      if (free < 0) return false;
    }
    std::array<std::uint16_t, kMaxBits + 2> place{}, code{};
    for (std::size_t length = 1; length <= kMaxBits; ++length) {
      place[length + 1] = static_cast<std::uint16_t>(place[length] + count_[length]);
      code[length + 1] = static_cast<std::uint16_t>((code[length] + count_[length]) << 1U);
    }
    for (std::size_t symbol = 0; symbol < lengths.size(); ++symbol) {
      const std::uint8_t length = lengths[symbol];
      if (length == 0) continue;
      symbols_[place[length]++] = static_cast<std::uint16_t>(symbol);
      if (length <= kFastBits) fill_fast(code[length], length, symbol);
      ++code[length];
    }
    return true;
  }

  [[nodiscard]] int decode(BitReader& reader) const {
    const Entry entry = fast_[reader.peek(kFastBits)];
    if (entry.length != 0) {
      reader.drop(entry.length);
      return entry.symbol;
    }
    int code = 0, first = 0, index = 0;
    const std::uint32_t bits = reader.peek(kMaxBits);
    for (unsigned length = 1; length <= kMaxBits; ++length) {
      code |= static_cast<int>((bits >> (length - 1)) & 1U);
      const int count = count_[length];
      if (code - first < count) {
        reader.drop(length);
        return symbols_[static_cast<std::size_t>(index + code - first)];
      }
      index += count;
      first = (first + count) * 2;
      code *= 2;
    }
    return kNoSymbol;
  }

 private:
  static constexpr unsigned kMaxBits = 15, kFastBits = 10;
  struct Entry {
    std::uint16_t symbol{0};
    std::uint8_t length{0};
  };

  /// Every table index whose low bits are the code, first bit lowest.
  void fill_fast(unsigned code, unsigned length, std::size_t symbol) {
    unsigned reversed = 0;
    for (unsigned bit = 0; bit < length; ++bit) reversed |= ((code >> bit) & 1U) << (length - 1 - bit);
    for (std::size_t index = reversed; index < fast_.size(); index += std::size_t{1} << length)
      fast_[index] = {static_cast<std::uint16_t>(symbol), static_cast<std::uint8_t>(length)};
  }

  std::array<int, kMaxBits + 1> count_{};
  std::array<std::uint16_t, 288> symbols_{};
  std::array<Entry, std::size_t{1} << kFastBits> fast_{};
};

/// Unpacks one stream; an empty text on success, else what is wrong.
class Inflater {
 public:
  Inflater(std::span<const std::uint8_t> packed, std::vector<std::uint8_t>& out, std::size_t size)
      : reader_(packed), out_(out), size_(size) {
    out_.clear();
    out_.reserve(size);
  }

  [[nodiscard]] const char* run() {
    const std::uint32_t method = reader_.take(8), flags = reader_.take(8);
    if ((method & 15U) != 8 || (method * 256 + flags) % 31 != 0 || (flags & 32U) != 0) return "the packed data have no zlib header";
    for (bool last = false; !last;) {
      last = reader_.take(1) == 1;
      const std::uint32_t kind = reader_.take(2);
      const char* wrong = kind == 0   ? stored()
                          : kind == 1 ? fixed()
                          : kind == 2 ? dynamic()
                                      : "the packed data have a block of an unknown kind";
      if (*wrong) return wrong;
      if (reader_.overrun()) return kEndsEarly;
    }
    if (out_.size() != size_) return "the packed data unpack to fewer bytes than the image needs";
    reader_.align();
    std::uint32_t sum = 0;
    for (int i = 0; i < 4; ++i) sum = (sum << 8U) | reader_.take(8);
    if (reader_.overrun()) return kEndsEarly;
    return sum == adler32(out_) ? "" : "the checksum of the packed data is wrong";
  }

 private:
  static constexpr const char* kEndsEarly = "the packed data end early";
  static constexpr const char* kTooLong = "the packed data unpack to more bytes than the image has";
  static constexpr const char* kNoCode = "the packed data hold a code that does not exist";

  [[nodiscard]] const char* stored() {
    reader_.align();
    const std::uint32_t length = reader_.take(16), complement = reader_.take(16);
    if ((length ^ complement) != 0xffff) return "a stored block of the packed data has a wrong length";
    if (length > size_ - out_.size()) return kTooLong;
    for (std::uint32_t i = 0; i < length; ++i) out_.push_back(static_cast<std::uint8_t>(reader_.take(8)));
    return "";
  }

  [[nodiscard]] const char* fixed() {
    std::array<std::uint8_t, 288> lengths;
    for (std::size_t i = 0; i < lengths.size(); ++i) lengths[i] = i < 144 ? 8 : i < 256 ? 9 : i < 280 ? 7 : 8;
    std::array<std::uint8_t, 30> distances;
    distances.fill(5);
    if (!literals_.build(lengths) || !distances_.build(distances)) return kNoCode;
    return block();
  }

  [[nodiscard]] const char* dynamic() {
    constexpr std::array<std::uint8_t, 19> kOrder{16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15};
    const std::size_t literals = reader_.take(5) + 257, distances = reader_.take(5) + 1, codes = reader_.take(4) + 4;
    if (literals > 286 || distances > 30) return kNoCode;
    std::array<std::uint8_t, 320> lengths{};
    for (std::size_t i = 0; i < codes; ++i) lengths[kOrder[i]] = static_cast<std::uint8_t>(reader_.take(3));
    HuffmanCode code;
    if (!code.build(std::span{lengths}.first(19))) return kNoCode;
    lengths.fill(0);
    for (std::size_t i = 0; i < literals + distances;) {
      const int symbol = code.decode(reader_);
      if (symbol < 0 || reader_.overrun()) return kNoCode;
      if (symbol < 16) {
        lengths[i++] = static_cast<std::uint8_t>(symbol);
        continue;
      }
      if (symbol == 16 && i == 0) return kNoCode;
      const std::uint8_t repeated = symbol == 16 ? lengths[i - 1] : std::uint8_t{0};
      std::size_t count = symbol == 16 ? 3 + reader_.take(2) : symbol == 17 ? 3 + reader_.take(3) : 11 + reader_.take(7);
      if (count > literals + distances - i) return kNoCode;
      for (; count > 0; --count) lengths[i++] = repeated;
    }
    if (!literals_.build(std::span{lengths}.first(literals)) || !distances_.build(std::span{lengths}.subspan(literals, distances)))
      return kNoCode;
    return block();
  }

  /// Literals and copies up to the end of the block.
  [[nodiscard]] const char* block() {
    constexpr std::array<std::uint16_t, 29> kLength{3,  4,  5,  6,  7,  8,  9,  10, 11,  13,  15,  17,  19,  23, 27,
                                                    31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258};
    constexpr std::array<std::uint8_t, 29> kLengthBits{0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2,
                                                       2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0};
    constexpr std::array<std::uint16_t, 30> kDistance{1,    2,    3,    4,    5,    7,    9,    13,    17,    25,
                                                      33,   49,   65,   97,   129,  193,  257,  385,   513,   769,
                                                      1025, 1537, 2049, 3073, 4097, 6145, 8193, 12289, 16385, 24577};
    while (true) {
      const int symbol = literals_.decode(reader_);
      if (symbol < 0 || reader_.overrun()) return symbol < 0 ? kNoCode : kEndsEarly;
      if (symbol == 256) return "";
      if (symbol < 256) {
        if (out_.size() == size_) return kTooLong;
        out_.push_back(static_cast<std::uint8_t>(symbol));
        continue;
      }
      const auto row = static_cast<std::size_t>(symbol - 257);
      if (row >= kLength.size()) return kNoCode;
      const std::size_t length = kLength[row] + reader_.take(kLengthBits[row]);
      const int far = distances_.decode(reader_);
      if (far < 0 || far >= static_cast<int>(kDistance.size())) return kNoCode;
      const std::size_t distance =
          kDistance[static_cast<std::size_t>(far)] + reader_.take(far < 4 ? 0U : static_cast<unsigned>(far) / 2 - 1);
      if (distance > out_.size()) return "the packed data copy from before their beginning";
      if (length > size_ - out_.size()) return kTooLong;
      for (std::size_t i = 0; i < length; ++i) out_.push_back(out_[out_.size() - distance]);
    }
  }

  BitReader reader_;
  std::vector<std::uint8_t>& out_;
  std::size_t size_;
  HuffmanCode literals_, distances_;
};

}  // namespace detail

/// Unpacks a zlib stream to exactly `size` bytes in `out`; an empty text on success, else what is wrong.
[[nodiscard]] inline const char* inflate_zlib(std::span<const std::uint8_t> packed, std::size_t size, std::vector<std::uint8_t>& out) {
  return detail::Inflater{packed, out, size}.run();
}

}  // namespace searvins::examples

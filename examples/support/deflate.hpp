// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Compression for PNG: bytes to a zlib stream (RFC 1950) of deflate blocks (RFC 1951), each with its own Huffman codes.
///
/// Repetitions are found by one table of where three bytes stood last (greedy, the most recent place). For n = length - 3 or distance - 1
/// and k = floor(log2 n) the code and its extra bits follow without tables:
///
///     length     e = max(0, k - 2)    code = 257 + 4 e + (n >> e)    the low e bits of n        (258 alone is code 285)
///     distance   e = max(0, k - 1)    code =       2 e + (n >> e)    the low e bits of n
///
/// Too long codes are avoided by halving the counts until the tree is low enough.
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <queue>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "examples/support/checksums.hpp"

namespace searvins::examples {

namespace deflate_detail {

/// A number's code among lengths or distances.
struct ExtraCode {
  std::uint32_t code, extra, extra_bits;
};

[[nodiscard]] inline ExtraCode extra_code(std::uint32_t n, std::uint32_t kept_bits) {
  const auto width = static_cast<std::uint32_t>(std::bit_width(n));
  const std::uint32_t e = width > kept_bits ? width - kept_bits : 0;
  return {(e << (kept_bits - 1)) + (n >> e), n & ((1U << e) - 1), e};
}
[[nodiscard]] inline ExtraCode length_code(std::uint32_t length) {
  if (length == 258) return {285, 0, 0};
  ExtraCode c = extra_code(length - 3, 3);
  c.code += 257;
  return c;
}
[[nodiscard]] inline ExtraCode distance_code(std::uint32_t distance) { return extra_code(distance - 1, 2); }

/// Bits, the lowest first.
class BitWriter {
 public:
  void put(std::uint32_t bits, std::uint32_t count) {
    pending_ |= std::uint64_t{bits} << held_, held_ += count;
    for (; held_ >= 8; held_ -= 8, pending_ >>= 8U) bytes_.push_back(static_cast<char>(pending_ & 0xFFU));
  }
  [[nodiscard]] std::string finish() {
    if (held_ > 0) put(0, 8 - held_);
    return std::move(bytes_);
  }

 private:
  std::string bytes_;
  std::uint64_t pending_{0};
  std::uint32_t held_{0};
};

/// Canonical Huffman code of an alphabet.
template <std::size_t N>
struct HuffmanCode {
  std::array<std::uint8_t, N> lengths{};
  std::array<std::uint16_t, N> bits{};  ///< reversed: the first bit of the code is the lowest

  /// Code for symbols that occur so often, none longer than the limit. At least two symbols get a code, as decoders like it.
  HuffmanCode(std::array<std::uint32_t, N> counts, std::uint8_t longest) {
    for (std::size_t i = 0; std::count(counts.begin(), counts.end(), 0U) > static_cast<std::ptrdiff_t>(N) - 2; ++i)
      counts[i] = std::max(counts[i], 1U);
    while (!assign_lengths(counts, longest))
      for (std::uint32_t& count : counts) count = (count + 1) / 2;
    assign_bits();
  }

 private:
  [[nodiscard]] bool assign_lengths(const std::array<std::uint32_t, N>& counts, std::uint8_t longest) {
    using Node = std::pair<std::uint64_t, std::size_t>;
    std::priority_queue<Node, std::vector<Node>, std::greater<>> open;
    std::array<std::size_t, 2 * N> parent{};
    for (std::size_t i = 0; i < N; ++i)
      if (counts[i] > 0) open.push({counts[i], i});
    std::size_t next = N;
    for (; open.size() > 1; ++next) {
      const Node a = open.top();
      open.pop();
      const Node b = open.top();
      open.pop();
      parent[a.second] = parent[b.second] = next;
      open.push({a.first + b.first, next});
    }
    std::array<std::uint8_t, 2 * N> depth{};
    for (std::size_t i = next - 1; i-- > 0;) {
      if (i < N && counts[i] == 0) continue;
      depth[i] = static_cast<std::uint8_t>(depth[parent[i]] + 1);
      if (depth[i] > longest) return false;
    }
    std::copy_n(depth.begin(), N, lengths.begin());
    return true;
  }

  void assign_bits() {
    std::uint32_t code = 0;
    for (std::uint8_t length = 1; length <= 15; ++length, code <<= 1U)
      for (std::size_t i = 0; i < N; ++i)
        if (lengths[i] == length) bits[i] = reversed(code++, length);
  }

  [[nodiscard]] static std::uint16_t reversed(std::uint32_t code, std::uint32_t length) {
    std::uint32_t turned = 0;
    for (std::uint32_t k = 0; k < length; ++k) turned |= (code >> k & 1U) << (length - 1 - k);
    return static_cast<std::uint16_t>(turned);
  }
};

/// A literal byte (length 0) or a repetition.
struct Token {
  std::uint16_t length, distance_or_byte;
};

[[nodiscard]] inline std::vector<Token> tokens_of(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kWindow = 32768, kLongest = 258, kTable = 1U << 15U;
  std::vector<std::size_t> last(kTable, bytes.size());
  std::vector<Token> tokens;
  tokens.reserve(bytes.size());
  for (std::size_t i = 0; i < bytes.size();) {
    std::size_t length = 0, from = bytes.size();
    if (i + 3 < bytes.size()) {
      const std::uint32_t key = bytes[i] | std::uint32_t{bytes[i + 1]} << 8U | std::uint32_t{bytes[i + 2]} << 16U;
      std::size_t& slot = last[(key * 2654435761U) >> 17U];
      from = std::exchange(slot, i);
      if (from < i && i - from <= kWindow)
        while (length < kLongest && i + length < bytes.size() && bytes[from + length] == bytes[i + length]) ++length;
    }
    // Three bytes from far away cost more than they save.
    if (length >= 4 || (length == 3 && i - from < 1024)) {
      tokens.push_back({static_cast<std::uint16_t>(length), static_cast<std::uint16_t>(i - from)});
      i += length;
    } else {
      tokens.push_back({0, bytes[i++]});
    }
  }
  return tokens;
}

inline void write_block(std::span<const Token> tokens, bool is_last, BitWriter& out) {
  std::array<std::uint32_t, 286> literal_counts{};
  std::array<std::uint32_t, 30> distance_counts{};
  literal_counts[256] = 1;
  for (const Token t : tokens) {
    ++literal_counts[t.length == 0 ? t.distance_or_byte : length_code(t.length).code];
    if (t.length > 0) ++distance_counts[distance_code(t.distance_or_byte).code];
  }
  const HuffmanCode<286> literals(literal_counts, 15);
  const HuffmanCode<30> distances(distance_counts, 15);
  std::array<std::uint32_t, 19> length_counts{};
  for (const std::uint8_t l : literals.lengths) ++length_counts[l];
  for (const std::uint8_t l : distances.lengths) ++length_counts[l];
  const HuffmanCode<19> lengths(length_counts, 7);

  out.put(is_last ? 1 : 0, 1), out.put(2, 2);
  out.put(286 - 257, 5), out.put(30 - 1, 5), out.put(19 - 4, 4);
  for (const std::size_t i : {16U, 17U, 18U, 0U, 8U, 7U, 9U, 6U, 10U, 5U, 11U, 4U, 12U, 3U, 13U, 2U, 14U, 1U, 15U})
    out.put(lengths.lengths[i], 3);
  for (const std::uint8_t l : literals.lengths) out.put(lengths.bits[l], lengths.lengths[l]);
  for (const std::uint8_t l : distances.lengths) out.put(lengths.bits[l], lengths.lengths[l]);
  const auto put_literal = [&](std::size_t symbol) { out.put(literals.bits[symbol], literals.lengths[symbol]); };
  for (const Token t : tokens) {
    if (t.length == 0) {
      put_literal(t.distance_or_byte);
      continue;
    }
    const ExtraCode length = length_code(t.length), distance = distance_code(t.distance_or_byte);
    put_literal(length.code), out.put(length.extra, length.extra_bits);
    out.put(distances.bits[distance.code], distances.lengths[distance.code]), out.put(distance.extra, distance.extra_bits);
  }
  put_literal(256);
}

}  // namespace deflate_detail

/// The bytes as a zlib stream.
[[nodiscard]] inline std::string zlib_compressed(std::span<const std::uint8_t> bytes) {
  constexpr std::size_t kBlock = 1U << 16U;
  const std::vector<deflate_detail::Token> tokens = deflate_detail::tokens_of(bytes);
  deflate_detail::BitWriter out;
  out.put(0x78, 8), out.put(0x01, 8);
  std::size_t done = 0;
  do {
    const std::size_t n = std::min(kBlock, tokens.size() - done);
    deflate_detail::write_block(std::span{tokens}.subspan(done, n), done + n == tokens.size(), out);
    done += n;
  } while (done < tokens.size());
  std::string stream = out.finish();
  const std::uint32_t sum = adler32(bytes);
  for (const std::uint32_t shift : {24U, 16U, 8U, 0U}) stream.push_back(static_cast<char>(sum >> shift & 0xFFU));
  return stream;
}

}  // namespace searvins::examples

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// Label images made offline: a folder in EuRoC layout, `data.csv` (`#timestamp [ns],filename`) and `data/<ns>.png`, each pixel the number
/// of its class in the rectified left image. Times are GPS nanoseconds since 1980-01-06. An image is read when it is asked for, and the
/// last one is kept.
#pragma once

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <searvins/core/time.hpp>
#include <searvins/io/diagnostic.hpp>
#include <searvins/io/file_result.hpp>
#include <searvins/io/text_fields.hpp>
#include <searvins/io/text_reader.hpp>

#include "examples/support/gray_image.hpp"
#include "examples/support/image_reader.hpp"

namespace searvins::precomputed {

/// See the file comment.
class LabelFolder {
 public:
  static constexpr double kToleranceS = 0.005;  ///< an image is of a frame when their times differ by no more

  /// Reads the list of images. Errors: no data.csv, a row that cannot be read (with its line), no row at all.
  [[nodiscard]] std::optional<io::Diagnostic> open(const std::filesystem::path& folder) {
    folder_ = folder;
    entries_.clear();
    loaded_.reset();
    io::TextReader reader;
    if (auto error = reader.open(folder / "data.csv")) return error;
    std::string_view line;
    while (reader.next(line)) {
      if (line.empty() || line.front() == '#') continue;
      const std::vector<std::string_view> fields = io::split(line, ',');
      Entry entry;
      if (fields.size() != 2 || !io::parse_integer(fields[0], entry.time.ns) || fields[1].empty())
        return io::Diagnostic{reader.name(), reader.line_number(), "the row is not \"nanoseconds,filename\"", {}};
      entry.name = fields[1];
      entries_.push_back(std::move(entry));
    }
    if (entries_.empty()) return io::Diagnostic{reader.name(), 0, "lists no image", {}};
    std::stable_sort(entries_.begin(), entries_.end(), [](const Entry& a, const Entry& b) { return a.time < b.time; });
    return std::nullopt;
  }

  [[nodiscard]] std::size_t size() const { return entries_.size(); }

  /// The labels at a time; nullptr when there are none within the tolerance. Good until the next call. Errors: those of read_image.
  [[nodiscard]] io::FileResult<const examples::GrayImage*> at(GpsTime time) {
    const std::size_t i = nearest(time);
    if (i == entries_.size() || std::abs(seconds_between(entries_[i].time, time)) > kToleranceS)
      return static_cast<const examples::GrayImage*>(nullptr);
    if (loaded_ != i) {
      auto image = examples::read_image((folder_ / "data" / entries_[i].name).string());
      if (!image) return image.error();
      image_ = std::move(image).value();
      loaded_ = i;
    }
    return &image_;
  }

 private:
  struct Entry {
    GpsTime time{};
    std::string name;
  };

  [[nodiscard]] std::size_t nearest(GpsTime time) const {
    const auto after = std::lower_bound(entries_.begin(), entries_.end(), time, [](const Entry& e, GpsTime t) { return e.time < t; });
    const auto i = static_cast<std::size_t>(after - entries_.begin());
    if (i == 0) return 0;
    if (i == entries_.size()) return i - 1;
    return seconds_between(entries_[i - 1].time, time) < seconds_between(time, entries_[i].time) ? i - 1 : i;
  }

  std::filesystem::path folder_;
  std::vector<Entry> entries_;
  std::optional<std::size_t> loaded_;
  examples::GrayImage image_;
};

}  // namespace searvins::precomputed

// SPDX-License-Identifier: BSD-3-Clause
/// \file
/// searvins_cortex_m_compare TARGET HOST: whether two transcripts (transcript.hpp) say the same, to the tolerance that each line states.
/// Prints the largest difference of each name. 0: they do; 1: they do not; 2: nothing to compare.
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

namespace {

struct Entry {
  std::string name, index, number, word, kind;  ///< word and kind are empty for an integer
};

std::vector<Entry> read(const char* path) {
  std::vector<Entry> entries;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    Entry e;
    std::string subject, equals;
    std::istringstream{line} >> subject >> equals >> e.number >> e.word >> e.kind;
    const std::size_t bracket = subject.find('[');
    e.name = subject.substr(0, bracket), e.index = bracket == std::string::npos ? "" : subject.substr(bracket);
    entries.push_back(e);
  }
  return entries;
}

double value_of(const Entry& e) { return std::bit_cast<double>(static_cast<std::uint64_t>(std::strtoull(e.word.c_str(), nullptr, 16))); }

/// Largest differences of one name.
struct Group {
  int count{0}, same_bits{0}, wrong{0};
  double worst{0};
  std::string kind;
};

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: searvins_cortex_m_compare TARGET HOST\n");
    return 2;
  }
  const std::vector<Entry> target = read(argv[1]), host = read(argv[2]);
  if (target.empty()) {
    std::fprintf(stderr, "%s: no numbers\n", argv[1]);
    return 2;
  }
  int wrong = target.size() == host.size() ? 0 : 1;
  if (wrong != 0) std::printf("%zu numbers against %zu\n", target.size(), host.size());
  std::vector<std::string> order;
  std::map<std::string, Group> groups;
  for (std::size_t k = 0; k < target.size() && k < host.size(); ++k) {
    const Entry &t = target[k], &h = host[k];
    Group& g = groups[t.name];
    if (g.count++ == 0) order.push_back(t.name), g.kind = t.kind.empty() ? "integer" : t.kind;
    bool same = t.name == h.name && t.index == h.index && t.kind == h.kind && t.number == h.number && t.word == h.word;
    g.same_bits += same ? 1 : 0;
    if (!same && t.name == h.name && t.index == h.index && t.kind == h.kind && t.kind.starts_with("1e-")) {
      const double a = value_of(t), b = value_of(h), difference = std::abs(a - b) / (1 + std::abs(b));
      g.worst = std::max(g.worst, difference);
      same = difference <= std::strtod(t.kind.c_str(), nullptr);  // false for NaN
    }
    if (same) continue;
    ++wrong, ++g.wrong;
    std::printf("differ: %s%s = %s, host %s%s = %s\n", t.name.c_str(), t.index.c_str(), t.number.c_str(), h.name.c_str(), h.index.c_str(),
                h.number.c_str());
  }
  std::printf("%-28s %8s %9s %10s %12s\n", "name", "numbers", "same bits", "tolerance", "difference");
  for (const std::string& name : order) {
    const Group& g = groups[name];
    std::printf("%-28s %8d %9d %10s %12.2g\n", name.c_str(), g.count, g.same_bits, g.kind.c_str(), g.worst);
  }
  std::printf(wrong == 0 ? "%zu numbers agree\n" : "%zu numbers compared: they do not agree\n", target.size());
  return wrong == 0 ? 0 : 1;
}

// SPDX-License-Identifier: BSD-3-Clause
// What an RTK estimator takes, capacity by capacity: compile-time constants, printed.
#include "examples/cortex_m/capacities.hpp"
#include "examples/cortex_m/transcript.hpp"

namespace searvins::cortex_m {
namespace {

template <class Capacity>
void print(const char* name) {
  constexpr RamBudget b = ram_budget<Capacity>();
  Line line;
  line.text("# ").text(name).text(": ").integer(Capacity::states).text(" states, ").integer(Capacity::phases_per_epoch).text(" phases | ");
  for (const std::size_t part : {b.whole, b.smoother, b.tables, b.pools, b.elimination, b.priors, b.differencing, b.ambiguities})
    line.integer(static_cast<std::int64_t>((part + 999) / 1000)).text(" | ");
  line.end();
}

}  // namespace
}  // namespace searvins::cortex_m

int main() {
  using namespace searvins::cortex_m;
  write("# kB: whole | smoother | its tables | its values and factors | its elimination | its priors | differencing | resolution |\n");
  print<TinyCapacity>("tiny");
  print<SmallCapacity>("small");
  print<MediumCapacity>("medium");
  print<searvins::estimator::HostedCapacity>("hosted");
  return finish(ram_budget<SmallCapacity>().whole <= kRamBudgetBytes);
}

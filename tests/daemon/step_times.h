// What the pins of motors did.
#pragma once

#include <cstddef>
#include <map>
#include <utility>
#include <vector>

#include "sim/edge.h"

namespace bushd::test {

// When each motor made its steps, by MCU and output, and the pulses of position compare.
class StepTimes final : public sim::EdgeSink {
 public:
  void edge(const sim::Edge& edge) override {
    if (edge.signal == sim::Signal::kPositionCompare) pulses.push_back(edge);
    if (edge.signal != sim::Signal::kStep || !edge.level) return;
    at_ns_[{edge.mcu, edge.index}].push_back(edge.time_ns);
  }
  void settled(sim::TimeNs) override {}

  const std::vector<sim::TimeNs>& of(std::size_t mcu, unsigned output) {
    return at_ns_[{mcu, output}];
  }
  bool none() const { return at_ns_.empty(); }

  std::vector<sim::Edge> pulses;

 private:
  std::map<std::pair<std::size_t, unsigned>, std::vector<sim::TimeNs>> at_ns_;
};

}  // namespace bushd::test

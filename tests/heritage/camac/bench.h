// Crates with one module, and what the module asks of motors.
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "heritage/camac/bushd1.h"
#include "heritage/camac/bushd2.h"
#include "heritage/camac/crate.h"

namespace bushd::camac {

// "X Q data", so that a failure can be read.
inline std::string text(const Response& response) {
  return std::string(response.x ? "X " : "- ") + (response.q ? "Q " : "- ") +
         std::to_string(response.data);
}

class MotorsBench final : public Motors {
 public:
  MotorStatus status(int motor) override { return statuses[static_cast<std::size_t>(motor)]; }
  bool move(const Program& program) override {
    moves.push_back(program);
    return accepts;
  }
  void stop(int motor) override { stops.push_back(motor); }

  std::array<MotorStatus, Bushd2::kMotors> statuses{};
  bool accepts = true;
  std::vector<Program> moves;
  std::vector<int> stops;
};

class ShutterBench final : public Shutter {
 public:
  bool step(const SingleStep& step) override {
    steps.push_back(step);
    return accepts;
  }
  bool travel(const Travel& travel) override {
    travels.push_back(travel);
    return accepts;
  }
  void stop() override { ++stops; }

  bool accepts = true;
  std::vector<SingleStep> steps;
  std::vector<Travel> travels;
  int stops = 0;
};

// Names for the eleven commands.
template <class Module>
class Commands {
 public:
  static constexpr int kStation = 5;

  Response cycle(int a, int f, std::uint32_t data = 0) {
    return crate.cycle(kStation, {.subaddress = a, .function = f, .data = data});
  }
  Response read() { return cycle(0, 0); }
  std::uint32_t address() { return cycle(1, 0).data; }
  std::uint32_t control() { return cycle(2, 0).data; }
  std::uint32_t requests() { return cycle(3, 0).data; }
  bool lam() { return cycle(0, 8).q; }
  void clear_lam() { cycle(0, 10); }
  void write(std::uint32_t byte) { cycle(0, 16, byte); }
  void set_address(std::uint32_t address) { cycle(1, 16, address); }
  void set_control(std::uint32_t control) { cycle(2, 16, control); }
  void forbid() { cycle(0, 24); }
  void permit() { cycle(0, 26); }
  void permit(std::uint32_t control) {
    set_control(control);
    permit();
  }
  void write_at(std::uint32_t address, const std::vector<int>& bytes) {
    set_address(address);
    for (const int byte : bytes) write(static_cast<std::uint32_t>(byte));
  }

  Crate crate;
};

}  // namespace bushd::camac

// A lab with a crate: BUSHD-2 at station 5 with m01 and m02, BUSHD-1 at station 7 with m03, each
// kind with a group of its own.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include "daemon/lab.h"

namespace bushd::test {

constexpr int kStation = 5;
constexpr int kShutterStation = 7;

// Keys are those of m01 and of m03.
inline std::string lab_with(const std::string& manner = "fine", const std::string& motor_keys = "",
                            const std::string& shutter_keys = "") {
  std::string toml = hall(1, 3, manner);
  const std::string last = "output = 2\ngroup = \"axes\"\n";
  toml.replace(toml.find(last), last.size(), "output = 2\ngroup = \"shutters\"\n" + shutter_keys);
  return with_keys(toml, "m01", motor_keys) +
         "[[group]]\nname = \"shutters\"\ntable = \"bushd2-constant\"\n"
         "[[crate]]\nnumber = 1\n"
         "[[crate.module]]\nstation = 5\ntype = \"bushd-2\"\nf_start_hz = 100\n"
         "motors = [\"m01\", \"m02\"]\n"
         "[[crate.module]]\nstation = 7\ntype = \"bushd-1\"\nmotor = \"m03\"\n";
}

class CamacLab : public Lab {
 public:
  explicit CamacLab(const std::string& toml = lab_with(), sim::EdgeSink* sink = nullptr,
                    int station = kStation, std::uint32_t disabled_capabilities = 0)
      : Lab(toml, "", sink, disabled_capabilities), station_(station) {
    connect();
  }
  Answer block(camac::Block block, int crate = 1) {
    return ask(api::Camac{.crate = crate, .block = std::move(block)});
  }
  camac::Response naf(int n, int a, int f, std::uint32_t data = 0) {
    const Answer answer = block({.cycles = {{n, a, f, data}}});
    if (!answer.camac) {
      ADD_FAILURE() << answer.reason;
      return {};
    }
    return answer.camac->block.responses.at(0);
  }
  void load_bytes(int address, const std::vector<int>& bytes) {
    naf(station_, 1, 16, static_cast<std::uint32_t>(address));
    camac::Block words{.mode = camac::BlockMode::kQStop};
    for (const int byte : bytes) {
      words.cycles.push_back({station_, 0, 16, static_cast<std::uint32_t>(byte)});
    }
    words.count = static_cast<std::uint32_t>(words.cycles.size());
    EXPECT_EQ(block(words).camac->block.tally, words.count);
  }
  void load(int page, int steps, const std::vector<int>& codes) {
    std::vector<int> bytes{steps % 256, steps / 256};
    bytes.insert(bytes.end(), codes.begin(), codes.end());
    load_bytes(page * 256, bytes);
  }
  void permit(std::uint32_t control) {
    naf(station_, 2, 16, control);
    naf(station_, 0, 26);
  }
  std::uint32_t requests() { return naf(station_, 3, 0).data; }
  bool lam() { return naf(station_, 0, 8).q; }
  bool wait_for_lam(double limit_s = 60) {
    const std::size_t before = lams().size();
    return run_until([&] { return lams().size() > before; }, limit_s);
  }
  // A motion begins, and ends with a request.
  void run_to_lam(std::uint32_t control) {
    permit(control);
    if (!wait_for_lam()) throw std::runtime_error("no LAM has come");
  }

 private:
  int station_;
};

// The mechanics behind the pins of the shutter, and the reactor.
class Shutter final : public sim::EdgeSink {
 public:
  struct Step {
    sim::TimeNs time_ns;
    bool left;
  };

  void edge(const sim::Edge& edge) override {
    if (edge.index != 2) return;
    if (edge.signal == sim::Signal::kDir) left_ = !edge.level;
    if (edge.signal != sim::Signal::kStep || !edge.level) return;
    position += left_ ? -1 : 1;
    steps.push_back({edge.time_ns, left_});
    tell();
  }
  void settled(sim::TimeNs) override {}
  void reactor(bool starts) {
    reactor_ = starts;
    tell();
  }
  void tell() {
    unsigned active = others | (sensor ? 1U << 5 : 0U);
    if (position >= right_limit) active |= 1U << 3;
    if (position <= left_limit) active |= 1U << 4;
    if (bus != nullptr) {
      bus->mcu(0).set_inputs({static_cast<std::uint16_t>(active),
                              static_cast<std::uint8_t>(reactor_ ? BUSHD_INPUT_TRIGGER : 0)});
    }
  }

  sim::Bus* bus = nullptr;
  int position = 0;
  int left_limit = 0;
  int right_limit = 1000;
  bool sensor = false;
  unsigned others = 0;  // inputs of other motors
  std::vector<Step> steps;

 private:
  bool left_ = true;
  bool reactor_ = false;
};

// There before the lab, and after it.
struct WithShutter {
  Shutter mechanics;
};

// A BUSHD-1 with its shutter.
class MechanicsLab : private WithShutter, public CamacLab {
 public:
  explicit MechanicsLab(const std::string& toml) : CamacLab(toml, &mechanics, kShutterStation) {
    shutter().bus = &bus(0);
    shutter().tell();
    run_for(0.1);
  }
  Shutter& shutter() { return mechanics; }
  // Steps between the limits with these delays, and the adjustable delay.
  void load_codes(const std::vector<int>& codes, int delay) {
    shutter().right_limit = static_cast<int>(codes.size());
    shutter().tell();
    std::vector<int> bytes{static_cast<int>(codes.size()), 0, delay % 256, delay / 256};
    for (const int code : codes) {
      bytes.push_back(code % 256);
      bytes.push_back(code / 256);
    }
    load_bytes(0, bytes);
  }
};

class ShutterLab : public MechanicsLab {
 public:
  static constexpr sim::TimeNs kSlotNs = 2'560'000 / 128;
  static constexpr sim::TimeNs kUnitNs = 50'000;

  explicit ShutterLab(
      const std::string& keys = "inputs = { positive = 3, negative = 4, step = 5 }\n",
      const std::string& keys_of_m01 = "", const std::string& keys_of_module = "")
      : MechanicsLab(lab_with("fine", keys_of_m01, keys) + keys_of_module) {}
  std::uint32_t cleared_requests() {
    const std::uint32_t before = requests();
    naf(kShutterStation, 0, 10);
    return before;
  }
  // When the reactor started.
  sim::TimeNs reactor_starts() {
    const sim::TimeNs at_ns = bus(0).now_ns();
    shutter().reactor(true);
    run_for(0.01);
    shutter().reactor(false);
    return at_ns;
  }
  // The steps of a run, from the `first` one on, are where the codes put them after `begin_ns`.
  void expect_run(std::size_t first, sim::TimeNs begin_ns, const std::vector<int>& codes,
                  bool left) {
    const std::vector<Shutter::Step>& steps = shutter().steps;
    ASSERT_GE(steps.size(), first + codes.size());
    sim::TimeNs due_ns = begin_ns;
    for (std::size_t i = 0; i < codes.size(); ++i) {
      due_ns += codes[i] * kUnitNs;
      EXPECT_LE(std::abs(steps[first + i].time_ns - due_ns), kSlotNs) << "step " << i;
      EXPECT_EQ(steps[first + i].left, left);
    }
  }
};

}  // namespace bushd::test

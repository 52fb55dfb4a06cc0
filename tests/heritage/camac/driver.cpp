// A crate with BUSHD-2 at station 5 and BUSHD-1 at station 7, for the model of the two
// (modules_test.py). Reads an input a line from stdin: a cycle "naf N A F DATA", or what motors,
// inputs and the clock do. Answers each by a line "X Q DATA GRADED" (of inputs that are no cycles
// X, Q and data are "-"), and what the modules have asked of the motors meanwhile.
#include <array>
#include <cstdint>
#include <functional>
#include <iostream>
#include <map>
#include <sstream>
#include <string>

#include "heritage/camac/bushd1.h"
#include "heritage/camac/bushd2.h"
#include "heritage/camac/crate.h"

namespace bushd::camac {
namespace {

constexpr int kStation2 = 5;
constexpr int kStation1 = 7;

// So that a line says which codes, without all of them.
template <class Codes>
std::uint32_t checksum(const Codes& codes) {
  std::uint32_t sum = 0;
  for (const auto code : codes) sum = sum * 31 + code;
  return sum;
}

MotorStatus status_of(unsigned bits) {
  return {.right_limit = (bits & 1) != 0,
          .left_limit = (bits & 2) != 0,
          .supply_missing = (bits & 4) != 0,
          .not_connected = (bits & 8) != 0};
}

class Wanted final : public Motors, public Shutter {
 public:
  MotorStatus status(int motor) override { return statuses[static_cast<std::size_t>(motor)]; }
  bool move(const Program& p) override {
    asked << " move " << p.page << ' ' << p.motor << ' ' << p.left << ' ' << p.steps << ' '
          << checksum(p.codes);
    return accepts;
  }
  void stop(int motor) override { asked << " stop " << motor; }
  bool step(const SingleStep& step) override {
    asked << " step " << step.left << ' ' << step.with_sensor;
    return accepts;
  }
  bool travel(const Travel& t) override {
    asked << " travel " << t.left << ' ' << t.codes.size() << ' ' << checksum(t.codes) << ' '
          << t.delay << ' ' << t.synchronous;
    return accepts;
  }
  void stop() override { asked << " halt"; }

  std::array<MotorStatus, Bushd2::kMotors> statuses{};
  bool accepts = true;
  std::ostringstream asked;
};

class Driver {
 public:
  Driver() {
    crate_.insert(kStation2, bushd2_);
    crate_.insert(kStation1, bushd1_);
  }

  std::string carry_out(const std::string& line) {
    std::istringstream words(line);
    std::string what;
    words >> what;
    const auto next = [&words] {
      std::int64_t number = 0;
      words >> number;
      return number;
    };
    std::ostringstream out;
    if (what == "naf") {
      const auto n = static_cast<int>(next());
      const auto a = static_cast<int>(next());
      const auto f = static_cast<int>(next());
      const auto data = static_cast<std::uint32_t>(next());
      const Response response = crate_.cycle(n, {.subaddress = a, .function = f, .data = data});
      out << response.x << ' ' << response.q << ' ' << response.data;
    } else {
      follow(what, next);
      out << "- - -";
    }
    out << ' ' << crate_.requests() << wanted_.asked.str();
    wanted_.asked.str("");
    return out.str();
  }

 private:
  void follow(const std::string& what, const std::function<std::int64_t()>& next) {
    if (what == "status") {
      const auto motor = static_cast<std::size_t>(next());
      wanted_.statuses.at(motor) = status_of(static_cast<unsigned>(next()));
    } else if (what == "accept") {
      wanted_.accepts = next() != 0;
    } else if (what == "answer") {
      const auto steps = static_cast<std::uint32_t>(next());
      bushd2_.answer(steps, status_of(static_cast<unsigned>(next())));
    } else if (what == "ends") {
      const MotorStatus status = status_of(static_cast<unsigned>(next()));
      bushd2_.ends(status, static_cast<std::uint32_t>(next()));
    } else if (what == "limits") {
      const bool right = next() != 0;
      bushd1_.limits(right, next() != 0);
    } else {
      const std::map<std::string, std::function<void()>> events{
          {"step_done", [this] { bushd1_.step_done(); }},
          {"step_not_done", [this] { bushd1_.step_not_done(); }},
          {"run_step_done", [this] { bushd1_.run_step_done(); }},
          {"run_ends", [this] { bushd1_.run_ends(); }},
          {"stands", [this] { bushd1_.stands(); }}};
      events.at(what)();
    }
  }

  Wanted wanted_;
  Bushd2 bushd2_{wanted_};
  Bushd1 bushd1_{wanted_};
  Crate crate_;
};

}  // namespace
}  // namespace bushd::camac

int main() {
  bushd::camac::Driver driver;
  for (std::string line; std::getline(std::cin, line);) std::cout << driver.carry_out(line) << '\n';
  return 0;
}

// A lab whose motors are watched: each step of their pins must belong to somebody who has asked for
// it, and what is told of rest, positions and results must be what the pins do.
//
// A motor may make steps
// - while a request that moves it is open and no stop of it that arrived later is done,
// - while a local input, or the keypad, moves it, and until it rests after that,
// - while a program of a crate moves it,
// - after its MCU was lost, or the daemon was, until it rests: the MCU goes on by itself.
#pragma once

#include <gtest/gtest.h>

#include <cstdint>
#include <map>
#include <random>
#include <set>
#include <string>
#include <vector>

#include "daemon/lab.h"

namespace bushd::test::matrix {

// What there is to try of motors: homing, limits, a step sensor, backlash and settling, local
// inputs, a keypad, modules of a crate, and an MCU that disables its drivers at rest.
std::string installation(const std::string& manner);
inline const std::vector<std::string> kMotors{"a", "b", "c", "program", "shutter", "d", "e"};
inline const std::set<std::string> kLocal{"a"};
inline const std::set<std::string> kKeypad{"c"};
inline constexpr std::int64_t kShutterWay = 20;  // steps between its limit switches

class WatchedLab : public Lab {
 public:
  WatchedLab(const std::string& manner, std::uint32_t seed);

  // As the client "asker", or another one; returns its number.
  std::int64_t ask(const api::Request& request, const std::string& client = "asker");
  // Both check every event.
  void run(double seconds);
  bool run_till(const std::function<bool()>& done, double limit_s = 30);

  // Switches follow the motors; these are held besides.
  void hold_input(unsigned input, bool held);
  void press(std::uint8_t button);  // of MCU 1; 0: released
  void key(std::uint8_t byte);
  void cycle(int station, int subaddress, int function, std::uint32_t data = 0);
  void cut_line();  // until bring_to_rest()
  void reset_mcu(std::size_t mcu);
  void lose_daemon();  // it is gone without a word, and another one starts
  void end_daemon();   // it is asked to end; another one starts in bring_to_rest()

  // Everything ends, faults are cleared, and all motors stand at 0. Every request has its one
  // result then.
  void bring_to_rest();

  std::int64_t steps_of(const std::string& motor) const { return watched_.at(motor).shaft; }
  bool stands(const std::string& motor, double for_s = 0.25) const;
  int below(int n) { return static_cast<int>(random_() % static_cast<unsigned>(n)); }

 private:
  struct Ticket {
    std::int64_t number = 0;
    std::string what{};
    std::set<std::string> moves{};    // motors
    std::set<std::string> stops{};    // motors
    std::set<std::string> resumes{};  // motors
    std::set<std::string> places{};   // motors that may stand elsewhere on the scale then
    bool open = true;
  };
  struct Watched {
    std::int64_t shaft = 0;
    std::int64_t origin = 0;  // shaft steps where the daemon counts 0
    std::int64_t last_step_us = -1'000'000'000;
    std::int64_t said_to_rest_us = -1;  // since when; -1: it is not
    std::int64_t stopped_by = 0;  // the last stop that is done: earlier requests move it no more
    std::int64_t orphan_until_us = -1;  // what it did goes on without a daemon
    bool held = false;                  // a button for it, and no stop has ended that
    std::int64_t local_until_us =
        -1;  // what people do may begin until then, and goes on until it rests
    std::int64_t program_until_us = -1;  // may begin until then, and goes on until it rests
    bool may_be_placed = false;
    bool reported = false;  // one failure is enough
    std::int64_t paused_after =
        -1;  // stands paused since this request was the last one; -1: it does not
  };

  void look();
  void judge(const std::string& name, Watched& motor, std::int64_t shaft);
  void complain(Watched& motor, const std::string& what);
  void look_at(const std::string& name, Watched& motor);
  std::string why_it_may_move(const std::string& name, const Watched& motor) const;
  void follow(Ticket& ticket);
  void tell_inputs();
  void compare_positions();
  void orphan(const std::string& name);
  void settle_accounts();

  std::map<std::string, Watched> watched_;
  std::vector<Ticket> tickets_;
  std::mt19937 random_;
  unsigned held_inputs_ = 0;
  std::uint8_t button_ = 0;
  bool cut_ = false;
  bool ending_ = false;
};

}  // namespace bushd::test::matrix

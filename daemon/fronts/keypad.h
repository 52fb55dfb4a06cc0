// A keypad on a serial line as a client: its bytes become jogs, and what it shows goes back.
// Without I/O.
//
//     0x00 forward   0xFF reverse   0xFE slower, by one amount; beyond the slowest, the first speed
//     0xFD stop      anything else: nothing
//
// After each byte it is sent the delay of a step in units of 10 us, four decimal digits and a line
// feed, or "----" while its jog was refused or ended by others.
//
// Held, the keypad repeats the byte of the key that is pressed, and the motor ramps down when none
// has come for the keepalive time. Latched, a byte counts until the next one, as in the source;
// then it is the port that tells that the keypad is there.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "api/session.h"
#include "config/config.h"

namespace bushd::daemon {

class Keypad {
 public:
  // Carries a request out, or holds it until it can be.
  using Ask = std::function<void(api::Asker asker, api::Request request)>;

  // `config` outlives it.
  Keypad(const config::Keypad& config, std::string motor, Ask ask);
  ~Keypad();
  Keypad(const Keypad&) = delete;
  Keypad& operator=(const Keypad&) = delete;

  void port_opened();
  // Its jog ends.
  void port_lost();
  void receive(std::int64_t now_us, std::span<const std::uint8_t> bytes);
  // Renews what is latched.
  void step(std::int64_t now_us);
  std::int64_t next_wake_us() const;
  // What is to be sent since the last call.
  std::string take_display();

 private:
  class KeypadSession;
  void take(std::int64_t now_us, std::uint8_t byte);
  void go(std::int64_t now_us, int direction);
  void jog(int direction);
  void ask(const api::Jog& jog);
  void show();

  const config::Keypad& config_;
  const std::string motor_;
  const Ask ask_;
  std::shared_ptr<KeypadSession> session_;  // as long as the port is open
  std::uint32_t delay_us_;
  std::int64_t heard_us_ = 0;  // a byte of a direction, or its renewal
  std::string display_;
};

}  // namespace bushd::daemon

// What the bus asks of an MCU, whatever runs its firmware.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "firmware/core/port.h"
#include "sim/edge.h"

namespace bushd::sim {

class Mcu {
 public:
  // Where its bytes go.
  class Driver {
   public:
    Driver() = default;
    Driver(const Driver&) = delete;
    Driver& operator=(const Driver&) = delete;
    virtual ~Driver() = default;
    virtual void transmit(std::size_t mcu, TimeNs start_ns, const std::uint8_t* wire,
                          std::size_t size) = 0;
  };

  Mcu() = default;
  Mcu(const Mcu&) = delete;
  Mcu& operator=(const Mcu&) = delete;
  virtual ~Mcu() = default;

  virtual std::uint8_t address() const = 0;
  virtual std::uint16_t boot_number() const = 0;
  virtual bool running() const = 0;  // out of reset

  // What its pins say from now on, as in port.h.
  virtual void set_inputs(bushd_inputs inputs) = 0;
  virtual void set_current(std::uint16_t reading) = 0;  // 0..BUSHD_MAX_CURRENT

  // A byte of a keypad at a line of its own has ended at now_ns; and what has gone back since the
  // last call. An MCU without such a line takes no notice.
  virtual void keypad_byte(std::uint8_t byte, TimeNs now_ns) {
    (void)byte;
    (void)now_ns;
  }
  virtual std::string take_keypad_display() { return {}; }

  // When it next does something by itself.
  virtual TimeNs next_event_ns() const = 0;
  // May it now begin to speak at any time? If not, it does so in answer to a byte only, at a time
  // that it gives at once. While one may, time moves on in steps of a byte.
  virtual bool may_speak() const { return false; }

  // Everything up to now_ns (included) happens. Precondition: it is not before the last time given.
  virtual void advance(TimeNs now_ns) = 0;
  // The same, but not beyond the first byte that it begins to send: returns the time that has come.
  // Kinds that cannot stop there do nothing, and return less than until_ns.
  virtual TimeNs advance_until_it_speaks(TimeNs until_ns) {
    (void)until_ns;
    return 0;
  }
  // A byte's stop bit ended at now_ns. Advances to that time first.
  virtual void receive(std::uint8_t byte, TimeNs now_ns) = 0;
  // Its reset is pulled at now_ns; it boots again at boot_ns. An MCU that counts its boots itself
  // takes no notice of the number.
  virtual void reset(TimeNs now_ns, TimeNs boot_ns, std::uint16_t boot_number) = 0;
};

}  // namespace bushd::sim

// An MCU on the virtual bus that is an LM3S6965: its image runs in QEMU (lm3s6965evb), a process of
// its own that goes on only when and as far as the bus does. Its time is its instructions, 16 ns
// each; so the same calls give the same edges, to the ns, whatever else the machine has to do.
//
// QEMU's board is not all of the chip; machine.h adds what is missing, and the shift registers.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "sim/mcu.h"
#include "sim/qemu/lockstep.h"
#include "sim/qemu/memory_map.h"
#include "sim/wire.h"

namespace bushd::sim {

struct QemuOptions {
  std::string image;         // path of the ELF
  std::uint8_t address = 1;  // in its flash
  std::uint64_t unique_id = 1;
  std::uint16_t boots = 0;  // boot number of the boot before
  // Its journal has a record of each of the last so many boots.
  std::uint16_t recorded_boots = 1;
  // The port's file of owners (memory_map.h): then every access to memory is watched, and `advance`
  // throws at the first that must not be. Empty: none is.
  std::string memory_owners{};
};

class QemuMcu final : public Mcu {
 public:
  // It boots at time 0. Throws std::runtime_error if QEMU cannot be started; so do advance and
  // receive if it ends.
  QemuMcu(const QemuOptions& options, std::size_t index, Driver& driver, EdgeSink* sink);
  ~QemuMcu() override;

  // What the flash holds.
  std::uint8_t address() const override;
  std::uint16_t boot_number() const override;

  void set_inputs(bushd_inputs inputs) override;
  void set_current(std::uint16_t reading) override { current_ = reading; }

  bool running() const override { return now_ns_ >= boot_ns_; }
  TimeNs next_event_ns() const override { return may_speak() ? now_ns_ : kNever; }
  // Once it has heard a frame, until it surely has nothing more to say to it.
  bool may_speak() const override;
  void advance(TimeNs now_ns) override;
  TimeNs advance_until_it_speaks(TimeNs until_ns) override;
  void receive(std::uint8_t byte, TimeNs now_ns) override;
  void reset(TimeNs now_ns, TimeNs boot_ns, std::uint16_t boot_number) override;

  // What the current sensor reads when a conversion begins; not set: what set_current said.
  std::function<std::uint16_t(TimeNs time_ns)> on_conversion;

  // Faults of the chip.
  // A halfword of the program is another one.
  void poke(std::uint32_t address, std::uint16_t halfword) {
    order(LOCKSTEP_POKE, halfword, address);
  }
  void stop_ticks() { order(LOCKSTEP_STOP_TICKS, 0); }  // their timer interrupts no more
  // Bit 0 of a word is 1. Before the first advance.
  void stick_ram(std::uint32_t address) { order(LOCKSTEP_STICK, 0, address); }
  // Until the next boot; before the first advance.
  void wear_flash() { order(LOCKSTEP_WEAR_FLASH, 0); }      // it cannot be written
  void stick_inputs() { order(LOCKSTEP_STICK_INPUTS, 0); }  // the motors' all read high

  // Its next reset is that of a supply that was off, not one of its pin.
  void power_comes_back_next();
  // Flips a bit of what the image has written; from the next boot on.
  void flip_flash_bit(std::uint32_t address, int bit);

  // Words written to its flash while it ran.
  std::uint64_t flash_writes() const { return flash_writes_; }
  // Bytes lost in its receiver.
  std::uint64_t overruns() const { return overruns_; }
  // Bytes whose last stop bit was not over when driver-enable fell, or that began without it.
  std::uint64_t bytes_cut() const { return bytes_cut_; }

 private:
  void start(std::uint32_t reset_cause);
  void end();
  void fall(TimeNs now_ns);
  bool run();
  void send_orders();
  void order(lockstep_command_kind kind, std::uint32_t value, std::uint32_t address = 0,
             TimeNs time_ns = 0);
  void take(const lockstep_message& event);
  // Bit per output.
  unsigned& levels_of(Signal signal) { return levels_[static_cast<std::size_t>(signal)]; }
  void drive(TimeNs time_ns, Signal signal, unsigned to);
  std::uint16_t kept(std::uint32_t kind) const;

  void order_watch();
  [[noreturn]] void violated(const lockstep_message& event) const;
  [[noreturn]] void has_ended() const;

  QemuOptions options_;
  std::shared_ptr<const QemuMemoryMap> map_;
  std::size_t index_;
  Driver& driver_;
  EdgeSink* sink_;
  pid_t process_ = -1;
  int socket_ = -1;
  int complaints_ = -1;                           // a file with what QEMU writes to stderr
  std::vector<lockstep_message> orders_;          // not yet sent
  std::map<std::uint32_t, std::uint32_t> flash_;  // words that are not blank
  std::uint32_t kept_ram_ = 0;                    // over a watchdog reset
  std::uint32_t next_reset_ = 0;                  // RESC
  TimeNs now_ns_ = 0;
  TimeNs boot_ns_ = 0;
  TimeNs delimiter_ns_ = -1;  // that came last
  bool line_timer_ = false;
  bool until_it_speaks_ = false;
  bushd_inputs inputs_{};
  std::uint16_t current_ = 0;
  std::array<unsigned, static_cast<std::size_t>(Signal::kPositionCompare) + 1> levels_{};
  bool driver_enable_ = false;
  std::uint64_t flash_writes_ = 0;
  std::uint64_t overruns_ = 0;
  std::uint64_t bytes_cut_ = 0;
};

}  // namespace bushd::sim

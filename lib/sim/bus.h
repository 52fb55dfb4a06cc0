// A bus in simulated time: one master's port, a wire, and MCUs that run the firmware core. No I/O
// and no clock: time is moved by the caller, and the same calls always give the same result.
//
// Who hears what: an MCU hears every byte of the others and of the master, at the end of its stop
// bit, unless it drives the wire itself meanwhile (its receiver is off then) or is in reset. The
// master's port hears every byte of the MCUs (and of a second master) and not its own.
//
// Order of events: by time. What happens at the same ns goes thus: boots and tick boundaries, in
// the order in which the MCUs were added; then ends of bytes, the master's first, then the
// MCUs' in that order. A byte that ends with a tick is so heard at time 0 of the next.
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "sim/edge.h"
#include "sim/virtual_mcu.h"
#include "sim/wire.h"

namespace bushd::sim {

class Bus : private Mcu::Driver {
 public:
  // `sink` gets all edges; it outlives the bus. Without one, ticks cost no work per slot.
  explicit Bus(std::uint32_t baud, EdgeSink* sink = nullptr);

  // Returns its index. Several MCUs of one address are possible: that is a fault worth simulating.
  std::size_t add_mcu(const McuOptions& options);
  // The same for an MCU of another kind: `make` gets what VirtualMcu gets besides its options.
  using MakeMcu =
      std::function<std::unique_ptr<Mcu>(std::size_t index, Mcu::Driver& driver, EdgeSink* sink)>;
  std::size_t add_mcu(const MakeMcu& make);

  // Bytes for the wire at `at_ns` (>= now_ns()), or as soon as those given before are sent. The
  // master does not listen before it talks.
  void master_send(std::span<const std::uint8_t> bytes, TimeNs at_ns);

  // A byte for the master: called when its stop bit has ended. May call master_send.
  std::function<void(std::uint8_t byte, TimeNs end_ns)> on_master_byte;

  // A second master on the bus, behind an adapter of its own: it talks as the first one does,
  // without listening, and each hears the other. Call after the MCUs have been added.
  void add_second_master();
  void second_master_send(std::span<const std::uint8_t> bytes, TimeNs at_ns);
  std::function<void(std::uint8_t byte, TimeNs end_ns)> on_second_master_byte;

  // An MCU that runs has heard a byte. Looks on only: what it does must not reach the bus.
  std::function<void(std::size_t mcu, std::uint8_t byte, TimeNs end_ns)> on_mcu_byte;

  // Two have begun to talk at once. Addresses; 0 is the master.
  std::function<void(TimeNs time_ns, std::uint8_t first_address, std::uint8_t second_address)>
      on_collision;

  // Everything up to t_ns (included) happens. Precondition: t_ns >= now_ns().
  void advance_to(TimeNs t_ns);

  TimeNs now_ns() const { return now_ns_; }
  // When something happens next, if nothing comes from outside.
  TimeNs next_event_ns() const;
  // When the wire falls silent, if nothing more is sent; in the past if it is silent.
  TimeNs wire_busy_until_ns() const { return wire_.busy_until_ns(); }

  // Resets an MCU now: what it was sending breaks off, and it boots with the next boot number when
  // `down_ns` have passed.
  void reboot(std::size_t mcu, TimeNs down_ns = 0);

  // From now until then this MCU alone hears nothing: disturbances are not the same everywhere.
  void deafen(std::size_t mcu, TimeNs until_ns);
  // The master falls silent now: the byte on the bus breaks off, those behind it are dropped.
  void break_off_master() { wire_.silence(kMaster, now_ns_); }

  std::size_t mcu_count() const { return mcus_.size(); }
  Mcu& node(std::size_t index) { return *mcus_[index]; }
  // Precondition: it is a virtual one.
  VirtualMcu& mcu(std::size_t index) { return static_cast<VirtualMcu&>(*mcus_[index]); }
  const VirtualMcu& mcu(std::size_t index) const {
    return static_cast<const VirtualMcu&>(*mcus_[index]);
  }

  std::uint64_t collisions() const { return collisions_; }
  std::uint64_t corrupted_bytes() const { return corrupted_bytes_; }

 private:
  static constexpr std::size_t kMaster = 0;  // as a talker; MCU i is talker i + 1

  void transmit(std::size_t mcu, TimeNs start_ns, const std::uint8_t* wire,
                std::size_t size) override;
  std::uint8_t talker_address(std::size_t talker) const;
  TimeNs stride(TimeNs until_ns);
  void run_ticks_until(TimeNs t_ns);
  void deliver(const WireByte& byte);
  void settle(TimeNs t_ns);

  std::uint32_t baud_;
  std::size_t second_master_ = kMaster;  // as a talker; kMaster: there is none
  EdgeSink* sink_;
  Wire wire_;
  std::vector<std::unique_ptr<Mcu>> mcus_;
  std::vector<TimeNs> deaf_until_ns_;  // by MCU
  TimeNs now_ns_ = 0;
  TimeNs next_settling_ns_ = 0;
  std::uint64_t collisions_ = 0;
  std::uint64_t corrupted_bytes_ = 0;
};

}  // namespace bushd::sim

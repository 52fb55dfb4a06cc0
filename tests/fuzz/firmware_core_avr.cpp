// The core as the ATmega2560 has it: its configuration, answers at the end of the receiver's
// buffer, frames worked off in pieces, and the walk through what its EEPROM keeps. The port's own
// line.c and nvm.c run here (atmega2560/port.h), in a main loop like that of its main.c.
//
// Promises checked beside those of core_rig.h: who may use the memory that is borrowed. While an
// answer waits or is sent, nobody but its sender touches its bytes; while a frame is worked off, no
// byte is collected; the walk touches no codes but those of tables; what a reset finds whole is as
// long as its head says, and what the core had.
#include "fuzz/atmega2560/port.h"
#include "fuzz/core_rig.h"
#include "fuzz/poison.h"

namespace bushd::fuzz {
namespace {

constexpr unsigned kPollsPerWrittenByte = 4;
constexpr unsigned kSentPerTick = 40;  // bytes
constexpr unsigned kPollsPerTick = 8;
constexpr unsigned kPollsPerRestTick = 128;
constexpr unsigned kMostRestTicks = 1300;

class AvrRig final : public CoreRig {
 public:
  AvrRig()
      : CoreRig({.motors = BUSHD_MOTORS_PER_MCU,
                 .queue_ticks = 64,
                 .codes = 952,
                 .min_tick_ns = 900'000,
                 .pulse_ns = 2500,
                 .disabled_capabilities =
                     BUSHD_CAN_TABLE_TICKS | BUSHD_CAN_PROGRAM | BUSHD_CAN_ELEMENTARY,
                 .in_pieces = true}) {
    host_blank_eeprom();
    host_reset();
    nvm_find();
  }

  void pass() override {
    {
      const Poisoned answer = foreign_answer();
      CoreRig::pass();
    }
    for (unsigned i = 0; i < kSentPerTick && host_has_reply(); ++i) send();
    if (is_idle()) poll_eeprom(kPollsPerTick);
  }

  void trigger(std::int16_t share) override {
    const Poisoned answer = foreign_answer();
    CoreRig::trigger(share);
  }

  void sample(std::uint16_t share, std::uint16_t current) override {
    const Poisoned answer = foreign_answer();
    CoreRig::sample(share, current);
  }

  void feed(Bytes bytes) override {
    for (const std::uint8_t byte : bytes) {
      host_receive(byte);
      for (unsigned i = 0; i < turns_per_byte_; ++i) turn();
    }
    if (turns_per_byte_ == 0) catch_up();
  }

  void work(unsigned pieces) override {
    for (; pieces > 0; --pieces) turn();
  }

  // Only what the EEPROM holds comes back.
  void reset() override {
    host_reset();
    pending_ = 0;
    const nvm_found found = nvm_find();
    boot();
    if (found == NVM_WHOLE) {
      // What the walk has come to by then decides how much more there is.
      nvm_load(&mcu_);
      check_restored(host_nvm_size(), host_nvm_crc());
    }
    boot_is_over();
  }

  // Turns of the main loop from byte to byte; 0: it has always caught up.
  void set_pace(unsigned turns) { turns_per_byte_ = turns; }

  // Nothing comes meanwhile. Ticks enough to write what is kept.
  void rest(unsigned ticks) {
    finish();
    for (; ticks > 0 && rested_ < kMostRestTicks; --ticks, ++rested_) {
      pass();
      if (is_idle()) poll_eeprom(kPollsPerRestTick);
    }
  }

 protected:
  std::uint8_t* reply() override { return line_reply(&mcu_.receiver); }

  void transmit(Bytes wire, std::uint32_t delay_ns) override {
    BUSHD_REQUIRE(wire.data() == reply() && wire.size() <= BUSHD_MCU_MAX_REPLY);
    BUSHD_REQUIRE(!host_has_reply());
    line_transmit(wire.data(), wire.size(), delay_ns);
    pending_ = wire.size();
  }

  void finish() override {
    catch_up();
    while (host_has_reply()) send();
  }

 private:
  // Whoever is not its sender.
  Poisoned foreign_answer() {
    return host_has_reply() ? Poisoned(reply(), BUSHD_MCU_MAX_REPLY) : Poisoned();
  }

  bool frame_is_worked_off() const {
    return mcu_.answer.size == 0 && mcu_.stream.rows.next == mcu_.stream.rows.ticks.count;
  }

  // A turn of the main loop in which no tick begins, as in main.c.
  void turn() {
    bool worked = false;
    {
      const Poisoned answer = foreign_answer();
      worked = bushd_mcu_work(&mcu_);
    }
    if (!worked) hear_line();
    check_after_frames();
    if (line_is_idle()) send();
  }

  void hear_line() {
    BUSHD_REQUIRE(frame_is_worked_off());
    std::uint32_t ended = 0;
    bool ends = false;
    {
      const Poisoned answer = foreign_answer();
      ends = line_collect(&mcu_.receiver, &ended);
    }
    if (ends) {
      if (!line_may_take(&mcu_.receiver)) return send();
      const Poisoned answer = foreign_answer();
      line_take(&mcu_.receiver);
      bushd_mcu_receive(&mcu_, 0, static_cast<std::int32_t>(time_in_tick_ns()));
    } else if (is_idle()) {
      poll_eeprom(1);
    }
  }

  bool is_idle() const {
    return line_is_idle() && frame_is_worked_off() && !bushd_mcu_wants_samples(&mcu_);
  }

  void poll_eeprom(unsigned times) {
    const bool moves = mcu_.state == BUSHD_STATE_RUN ||
                       (mcu_.slot_buffer[0].active | mcu_.slot_buffer[1].active) != 0;
    if (moves) return;
    const Poisoned receiver(&mcu_.receiver, sizeof mcu_.receiver);
    const Poisoned free_codes(codes_.data() + mcu_.tables.codes_used,
                              (codes_.size() - mcu_.tables.codes_used) * sizeof codes_[0]);
    for (; times > 0; --times) {
      if (++polls_ % kPollsPerWrittenByte == 0) host_end_write();
      if (host_writes()) continue;
      nvm_poll(&mcu_);
      check_walk(host_walk());
    }
  }

  void catch_up() {
    while (!line_is_idle() || !frame_is_worked_off()) turn();
  }

  // A byte of the answer that is due.
  void send() {
    if (!host_has_reply()) return;
    if (!host_send(reply(), sent_.data(), &sent_size_)) return;
    BUSHD_REQUIRE(sent_size_ == pending_);
    check_transmission(Bytes(sent_).first(sent_size_));
  }

  std::array<std::uint8_t, BUSHD_MCU_MAX_REPLY> sent_{};
  std::size_t sent_size_ = 0;
  std::size_t pending_ = 0;  // bytes of the answer that was made last
  unsigned turns_per_byte_ = 0;
  unsigned polls_ = 0;
  unsigned rested_ = 0;
};

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::AvrRig rig;
  bushd::fuzz::run(rig, {data, size},
                   {[&](bushd::fuzz::Input& input) { rig.set_pace(input.u8() % 8u); },
                    [&](bushd::fuzz::Input& input) { rig.rest(bushd::fuzz::rest_ticks(input)); }});
  return 0;
}

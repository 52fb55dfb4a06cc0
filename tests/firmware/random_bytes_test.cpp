// Whatever comes over the line, in whatever order: counts are the pulses made, pulses come only
// with power, the state is one of four, and the next question is answered.
#include <random>

#include "engine/properties.h"
#include "firmware/rig.h"

namespace bushd::test {
namespace {

class Stranger {
 public:
  explicit Stranger(std::uint32_t seed) : random_(seed) {}

  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(random_() % n); }
  std::uint8_t byte() { return static_cast<std::uint8_t>(random_()); }
  Bytes bytes(std::size_t size) {
    Bytes all(size);
    for (std::uint8_t& b : all) b = byte();
    return all;
  }

  // Something that a master might send, with values that are often right, and sometimes bent.
  void speak(Rig& rig) {
    Bytes payload;
    std::uint8_t type = static_cast<std::uint8_t>(1 + below(18));
    if (type > BUSHD_MSG_TABLES) {
      type = static_cast<std::uint8_t>(BUSHD_MSG_TRIGGER + type - BUSHD_MSG_TABLES - 1);
    }
    switch (type) {
      case BUSHD_MSG_CONFIGURE:
        put32(payload, below(4) != 0 ? Rig::kTickNs : below(21'000'000));
        payload.push_back(static_cast<std::uint8_t>(below(20) != 0 ? format_ : below(3)));
        if (below(8) == 0) format_ ^= 1;
        put16(payload, below(3) != 0 ? 1 + below(60) : below(65536));
        break;
      case BUSHD_MSG_TABLE_BEGIN:
        codes_ = below(12);
        payload = {static_cast<std::uint8_t>(below(9)),
                   static_cast<std::uint8_t>(codes_),
                   0,
                   static_cast<std::uint8_t>(below(3)),
                   0,
                   static_cast<std::uint8_t>(below(200)),
                   0};
        put32(payload, below(3) != 0 ? 40'000 : below(2'000'000'000));
        slot_ = payload[0];
        put32(payload, static_cast<std::uint32_t>(random_()));
        head_.assign(payload.begin() + 1, payload.begin() + 11);
        break;
      case BUSHD_MSG_TABLE_DATA:
        payload = {slot_, 0, 0, static_cast<std::uint8_t>(codes_)};
        sent_.clear();
        for (std::uint32_t i = 0; i < codes_; ++i) {
          sent_.push_back(static_cast<std::uint8_t>(200 - 10 * i));
          sent_.push_back(0);
        }
        payload.insert(payload.end(), sent_.begin(), sent_.end());
        break;
      case BUSHD_MSG_TABLE_END: {
        Bytes all = head_;
        all.insert(all.end(), sent_.begin(), sent_.end());
        payload = {slot_};
        put32(payload, crc32(all));
        break;
      }
      case BUSHD_MSG_ASSIGN:
        payload = {static_cast<std::uint8_t>(below(17)), slot_};
        break;
      case BUSHD_MSG_CONTROL:
        payload = {static_cast<std::uint8_t>(below(8) == 0 ? byte() : 1 + 4 * below(2))};
        break;
      case BUSHD_MSG_SET_POSITION:
        payload = {static_cast<std::uint8_t>(below(17))};
        put32(payload, below(2) == 0 ? 0x7FFFFFFFu - below(3) : below(1000));
        break;
      case BUSHD_MSG_SYNC: {
        const bushd_report report = rig.poll();
        put16(payload, below(2));
        put32(payload, below(9) != 0 ? ++sync_id_ : sync_id_);
        payload.push_back(static_cast<std::uint8_t>(below(3) != 0));
        put32(payload, report.sync_id);
        put32(payload, below(3) != 0 ? report.sync_tick : report.sync_tick + below(5) - 2);
        put32(payload, below(3) != 0 ? report.sync_ns : below(2'600'000));
        if (below(200) == 0) payload[11 + below(4)] = byte();
        break;
      }
      case BUSHD_MSG_TICKS:
        payload = ticks(rig);
        break;
      case BUSHD_MSG_TRIGGER: {
        const bool disarms = below(5) == 0;
        payload = {static_cast<std::uint8_t>(disarms ? 0 : 1 + below(255)),
                   static_cast<std::uint8_t>(disarms ? 0 : 1 + below(2))};
        put32(payload, disarms ? 0 : 50 + below(100'000));
        if (disarms) break;
        const std::uint32_t motor = below(rig.options().motors);
        payload.push_back(static_cast<std::uint8_t>(motor | 0x80 * below(2)));
        put32(payload, 1 + below(50));
        break;
      }
      case BUSHD_MSG_POSITION_COMPARE:
        payload = {static_cast<std::uint8_t>(below(rig.options().motors)),
                   static_cast<std::uint8_t>(below(4))};
        put32(payload, below(20));
        put32(payload, below(20'000));
        put32(payload, 1 + below(20'000));
        break;
      default:
        break;
    }
    if (below(40) == 0 && !payload.empty())
      payload[below(static_cast<std::uint32_t>(payload.size()))] = byte();
    if (below(40) == 0) payload.resize(below(30));
    if (below(40) == 0) type = byte();
    const bool own = below(6) != 0;
    rig.frame(own ? rig.options().address : byte(), type, payload);
  }

 private:
  static void put16(Bytes& payload, std::uint32_t value) {
    for (int i = 0; i < 2; ++i) payload.push_back(static_cast<std::uint8_t>(value >> 8 * i));
  }
  static void put32(Bytes& payload, std::uint32_t value) {
    for (int i = 0; i < 4; ++i) payload.push_back(static_cast<std::uint8_t>(value >> 8 * i));
  }
  Bytes ticks(Rig& rig) {
    const bushd_mcu& mcu = rig.mcu();
    const bool fine = mcu.format == BUSHD_FORMAT_FINE;
    const std::uint8_t motor = static_cast<std::uint8_t>(below(rig.options().motors));
    const bool replace = below(4) == 0;
    const bool moves = mcu.motor[motor].delay != 0;
    const bool both = below(8) == 0;
    std::uint32_t first = mcu.motor[motor].known_until;
    if (replace) first -= below(20);
    if (!moves && !replace) first += below(5);
    if (below(20) == 0) first += below(2) == 0 ? 0x80000000u - below(300) : below(600) - 300;
    const auto count = static_cast<std::uint8_t>(1 + below(20));
    Ticks made{.flags = static_cast<std::uint8_t>(replace ? BUSHD_TICKS_REPLACE
                                                  : moves ? 0
                                                          : BUSHD_TICKS_START),
               .first = first,
               .count = count,
               .mask = static_cast<std::uint16_t>(1u << motor)};
    if (both) made.mask |= 1;
    const std::uint32_t columns = made.mask == (1u << motor) ? 1 : 2;
    for (std::uint32_t i = 0; i < count * columns; ++i) {
      made.displacements.push_back(below(10) == 0 ? static_cast<std::int16_t>(random_())
                                                  : static_cast<std::int16_t>(below(900)));
    }
    made.delays.assign(columns, static_cast<std::uint16_t>(below(2) == 0 ? 0 : below(300)));
    made.epoch = static_cast<std::uint8_t>(mcu.stream.epoch + (replace ? 1 : 0));
    Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
    std::size_t size = bushd_encode_ticks_head(
        made.epoch, static_cast<std::uint8_t>(made.flags | (fine ? BUSHD_TICKS_FINE : 0)),
        made.first, made.count, made.mask, made.delays.data(), payload.data());
    for (const std::int16_t displacement : made.displacements) {
      if (fine) {
        bushd_put_i16(payload.data() + size, displacement);
        size += 2;
      } else {
        payload[size++] = static_cast<std::uint8_t>(displacement);
      }
    }
    payload.resize(size);
    return payload;
  }

  std::mt19937 random_;
  std::uint32_t format_ = 1;
  std::uint32_t codes_ = 3;
  std::uint8_t slot_ = 0;
  Bytes head_;
  Bytes sent_;
  std::uint32_t sync_id_ = 100;
};

// A tick in which all that must hold is looked at from outside.
void pass_and_check(Rig& rig) {
  std::array<std::uint32_t, BUSHD_MOTORS_PER_MCU> expected{};
  const bushd_slot_buffer& slot_buffer = rig.slot_buffer();
  std::uint16_t stepped = 0;
  for (std::uint8_t m = 0; m < rig.options().motors; ++m) {
    std::uint32_t steps = 0;
    for (std::uint16_t slot = 0; slot < rig.options().slots; ++slot)
      steps += slot_buffer.step[slot] >> m & 1u;
    const bool forward = slot_buffer.direction >> m & 1;
    expected[m] = static_cast<std::uint32_t>(rig.mcu().motor[m].position_steps) +
                  (forward ? steps : 0u - steps);
    if (steps != 0) stepped |= static_cast<std::uint16_t>(1u << m);
  }
  for (std::uint16_t slot = 0; slot < rig.options().slots; ++slot) {
    RC_ASSERT((slot_buffer.step[slot] & ~stepped) == 0);  // outputs that do not exist
  }
  const std::uint16_t moving = rig.poll().moving;
  RC_ASSERT((stepped & ~moving) == 0);
  RC_ASSERT((rig.poll().armed & moving) == 0);
  rig.pass();
  const bushd_report report = rig.poll();
  for (std::uint8_t m = 0; m < rig.options().motors; ++m) {
    RC_ASSERT(static_cast<std::uint32_t>(report.motor[m].position_steps) == expected[m]);
  }
  RC_ASSERT(rig.steps_while_disabled() == 0);
  RC_ASSERT(report.state <= BUSHD_STATE_FAULT);
  RC_ASSERT((report.state == BUSHD_STATE_FAULT) == (report.faults != 0));
  RC_ASSERT((report.flags & BUSHD_FLAG_ENABLED) == (rig.enabled() ? BUSHD_FLAG_ENABLED : 0));
}

RigOptions any_options() {
  return {.motors = static_cast<std::uint8_t>(*rc::gen::element(1, 3, 16)),
          .slots = static_cast<std::uint16_t>(*rc::gen::element(128, 199, 256)),
          .queue_ticks = static_cast<std::uint16_t>(*rc::gen::element(16, 64)),
          .code_count = static_cast<std::uint16_t>(*rc::gen::element(5, 60))};
}

TEST(RandomBytes, AnyBytesAtAnyTimeDoNoHarm) {
  holds("bytes of all kinds", [] {
    Rig rig(any_options());
    Stranger stranger(between<std::uint32_t>(0, UINT32_MAX));
    for (int i = 0; i < 60; ++i) {
      // Delimiters often, so that noise is also decoded.
      Bytes bytes = stranger.bytes(stranger.below(400));
      for (std::uint8_t& b : bytes) b = b < 20 ? std::uint8_t{0} : b;
      rig.feed(bytes);
      rig.feed(Bytes{0});
      static_cast<void>(rig.answer());
      pass_and_check(rig);
    }
    RC_ASSERT(rig.identify().motors == rig.options().motors);
  });
}

TEST(RandomBytes, AnyRequestsInAnyOrderKeepCountsTrue) {
  // The property is worth nothing if no such stream ever moves a motor.
  std::int64_t steps = 0;
  int link_faults = 0;
  int triggered = 0;
  holds("well-formed frames, bent ones, and noise", [&] {
    Rig rig(any_options());
    Stranger stranger(between<std::uint32_t>(0, UINT32_MAX));
    const bool ready = between(0, 3) != 0;
    if (ready && rig.options().code_count > 40) {
      rig.make_ready(ramp_law(), between(0, 1) != 0 ? BUSHD_FORMAT_FINE : BUSHD_FORMAT_COARSE,
                     0u - between<std::uint32_t>(0, 200));
    }
    for (int i = 0; i < 300; ++i) {
      for (std::uint32_t n = stranger.below(4); n > 0; --n) {
        if (stranger.below(30) == 0) {
          rig.feed(stranger.bytes(stranger.below(40)));
          rig.feed(Bytes{0});
        } else {
          stranger.speak(rig);
        }
        static_cast<void>(rig.answer());
      }
      if (stranger.below(4) == 0) {
        rig.trigger(static_cast<std::int32_t>(stranger.below(4'000'000)) - 2'000'000);
        if (rig.poll().trigger_state == BUSHD_TRIGGER_STARTED) ++triggered;
      }
      pass_and_check(rig);
      if (rig.poll().faults & BUSHD_FAULT_LINK) ++link_faults;
    }
    for (std::uint8_t m = 0; m < rig.options().motors; ++m) {
      for (const int n : rig.history(m)) steps += n < 0 ? -n : n;
    }
    rig.feed(Bytes{0});
    RC_ASSERT(rig.identify().motors == rig.options().motors);
  });
  EXPECT_GT(steps, 1000);
  EXPECT_GT(link_faults, 100);
  EXPECT_GT(triggered, 100);
}

}  // namespace
}  // namespace bushd::test

#include "fuzz/core_programme.h"

namespace bushd::fuzz {
namespace {

// A frame's payload, as far as the input provides it; zeros after.
struct Payload {
  std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD> bytes{};
  std::size_t size = 0;

  void take(Input& input, std::size_t count) {
    count = std::min(count, bytes.size() - size);
    const Bytes taken = input.bytes(count);
    std::copy(taken.begin(), taken.end(), bytes.begin() + static_cast<std::ptrdiff_t>(size));
    size += count;
  }
  Bytes view() const { return Bytes(bytes).first(size); }
};

void send_frame(Programmed& mcu, Input& input) {
  const bool broadcast = (input.u8() & 1) != 0;
  const std::uint8_t type = input.u8();
  const std::uint8_t later = input.u8();
  Payload payload;
  payload.take(input, input.u8());
  const std::uint8_t address = broadcast ? BUSHD_ADDRESS_BROADCAST : mcu.sight().address;
  mcu.frame(address, type, payload.view(), later);
}

void send_ticks(Programmed& mcu, Input& input) {
  const Sight sight = mcu.sight();
  const std::uint8_t epoch = static_cast<std::uint8_t>(sight.epoch + input.u8());
  const std::uint8_t flags = input.u8();
  const std::uint32_t first =
      sight.tick + static_cast<std::uint32_t>(static_cast<std::int8_t>(input.u8()));
  const std::uint8_t count = input.u8();
  const std::uint8_t mask = input.u8();
  Payload payload;
  const std::array<std::uint16_t, 8> delays{};
  std::size_t motors = 0;
  payload.size = BUSHD_TICKS_HEADER;
  bushd_encode_ticks_head(epoch, flags, first, count, mask, delays.data(), payload.bytes.data());
  for (unsigned m = 0; m < 8; ++m) motors += mask >> m & 1;
  const std::size_t width = (flags & BUSHD_TICKS_FINE) != 0 ? 2 : 1;
  payload.take(input, 2 * motors);
  payload.take(input, width * motors * count);
  mcu.frame(sight.address, BUSHD_MSG_TICKS, payload.view());
}

void send_table_ticks(Programmed& mcu, Input& input) {
  const Sight sight = mcu.sight();
  const std::uint8_t epoch = static_cast<std::uint8_t>(sight.epoch + input.u8());
  const std::uint8_t flags = input.u8();
  const std::uint32_t first =
      sight.tick + static_cast<std::uint32_t>(static_cast<std::int8_t>(input.u8()));
  const std::uint16_t count = input.u8();
  Payload payload;
  payload.size =
      bushd_encode_table_ticks(epoch, flags, first, count, nullptr, 0, payload.bytes.data());
  payload.take(input, input.u8() % (2 * BUSHD_TABLE_TICKS_MAX_ENTRY));
  mcu.frame(sight.address, BUSHD_MSG_TABLE_TICKS, payload.view());
}

void send_table_run(Programmed& mcu, Input& input) {
  const Sight sight = mcu.sight();
  const std::uint8_t epoch = static_cast<std::uint8_t>(sight.epoch + input.u8() % 2u);
  const std::uint32_t first = sight.tick + input.u8() % 24u;
  std::array<bushd_table_run_entry, BUSHD_MOTORS_PER_MCU> entries{};
  const auto count = static_cast<std::uint8_t>(1 + input.u8() % sight.motors);
  for (std::uint8_t i = 0; i < count; ++i) {
    const std::uint8_t how = input.u8();
    entries[i] = {.motor = i,
                  .bank = static_cast<std::uint8_t>(how % BUSHD_TABLE_BANKS),
                  .direction = static_cast<std::int8_t>((how & 0x80) != 0 ? 1 : -1),
                  .steps = (how & 0x40) != 0 ? 0xFFFFu * input.u16() : input.u8(),
                  .shortest_delay = (how & 0x20) != 0 ? input.u16() : std::uint16_t{0}};
  }
  Payload payload;
  payload.size = bushd_encode_table_run(epoch, first, entries.data(), count, payload.bytes.data());
  mcu.frame(sight.address, BUSHD_MSG_TABLE_RUN, payload.view());
}

void send_sync(Programmed& mcu, Input& input) {
  const std::uint8_t mark = input.u8();
  const Sight sight = mcu.sight();
  const std::uint32_t tick_ns = sight.tick_ns;
  const std::uint32_t later_ns =
      static_cast<std::uint32_t>(std::uint64_t{tick_ns} * input.u16() >> 16);
  const std::uint32_t later_ticks =
      static_cast<std::uint32_t>(static_cast<std::int8_t>(input.u8()));
  const bushd_sync sync = {.master = static_cast<std::uint16_t>(sight.master + mark % 4 / 3),
                           .sync_id = sight.sync_id + mark / 4u,
                           .follows = true,
                           .follow_up_id = sight.sync_id,
                           .sync_tick = sight.sync_tick + later_ticks,
                           .sync_ns = (sight.sync_ns + later_ns) % tick_ns};
  Payload payload;
  payload.size = bushd_encode_sync(&sync, payload.bytes.data());
  mcu.frame(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_SYNC, payload.view());
}

void send_table_end(Programmed& mcu, Input& input) {
  bushd_table_end end = {.bank = static_cast<std::uint8_t>(input.u8() % (BUSHD_SCRATCH_BANK + 1)),
                         .crc = 0};
  end.crc = mcu.table_crc(end.bank);
  Payload payload;
  payload.size = bushd_encode_table_end(&end, payload.bytes.data());
  mcu.frame(mcu.sight().address, BUSHD_MSG_TABLE_END, payload.view());
}

void do_one(Op op, Programmed& mcu, Input& input) {
  switch (op) {
    case Op::kNoise:
      return mcu.feed(input.bytes(input.u8()));
    case Op::kTicksPass:
      for (unsigned i = input.u8() % 16u; i > 0; --i) mcu.pass();
      return;
    case Op::kTimeInTick:
      return mcu.set_time(input.u16());
    case Op::kFrame:
      return send_frame(mcu, input);
    case Op::kTicks:
      return send_ticks(mcu, input);
    case Op::kSync:
      return send_sync(mcu, input);
    case Op::kTableEnd:
      return send_table_end(mcu, input);
    case Op::kTableTicks:
      return send_table_ticks(mcu, input);
    case Op::kTableRun:
      return send_table_run(mcu, input);
    case Op::kPins: {
      const std::uint16_t motors = input.u16();
      const std::uint8_t system = input.u8();
      return mcu.set_pins(motors, system, input.u16());
    }
    case Op::kTrigger:
      return mcu.trigger(static_cast<std::int16_t>(input.u16()));
    case Op::kSample: {
      const std::uint16_t share = input.u16();
      return mcu.sample(share, input.u16());
    }
    case Op::kWork:
      return mcu.work(input.u8() % 16u);
    case Op::kReset:
      return mcu.reset();
    case Op::kCount:
      return;
  }
}

}  // namespace

void run(Programmed& mcu, Input input, const OwnOps& own) {
  const unsigned ops = static_cast<unsigned>(Op::kCount) + static_cast<unsigned>(own.size());
  mcu.begin();
  while (!input.empty()) {
    const unsigned op = input.u8() % ops;
    if (op < static_cast<unsigned>(Op::kCount)) {
      do_one(static_cast<Op>(op), mcu, input);
    } else {
      own[op - static_cast<unsigned>(Op::kCount)](input);
    }
  }
  mcu.check_answers();
}

}  // namespace bushd::fuzz

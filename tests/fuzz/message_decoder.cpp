// All decoders of messages, those of the MCU and those of the master, on one payload: what is
// accepted keeps the ranges that engine/message.h promises, and is what the encoder makes of it.
#include <array>
#include <bit>
#include <cstring>

#include "engine/message.h"
#include "engine/program.h"
#include "engine/run_state.h"
#include "engine/velocity.h"
#include "fuzz/fuzz.h"

namespace bushd::fuzz {
namespace {

using Bytes = std::span<const std::uint8_t>;
using Payload = std::array<std::uint8_t, BUSHD_FRAME_MAX_PAYLOAD>;

bool same(Bytes payload, const Payload& again, std::size_t size) {
  return size == payload.size() && std::memcmp(payload.data(), again.data(), size) == 0;
}

// The decoded message, having gone through the encoder as well; false: refused.
template <class Message, class Decode, class Encode>
bool decoded(Bytes payload, Message* message, Decode decode, Encode encode) {
  // Nothing must be left as it was in a message that is accepted.
  std::memset(static_cast<void*>(message), 0xA5, sizeof *message);
  const bushd_status status = decode(payload.data(), payload.size(), message);
  BUSHD_REQUIRE(status == BUSHD_OK || status == BUSHD_E_LENGTH || status == BUSHD_E_FORMAT);
  if (status != BUSHD_OK) return false;
  Payload again;
  BUSHD_REQUIRE(same(payload, again, encode(message, again.data())));
  return true;
}

bool inside(Bytes payload, const std::uint8_t* at, std::size_t size) {
  return at >= payload.data() && at + size <= payload.data() + payload.size();
}

void decode_for_mcu(Bytes payload) {
  bushd_identify identify;
  if (decoded(payload, &identify, bushd_decode_identify, bushd_encode_identify)) {
    BUSHD_REQUIRE(identify.windows >= 1);
    const std::uint8_t id[BUSHD_UNIQUE_ID_SIZE] = {1, 2, 3, 4, 5, 6, 7, 8};
    BUSHD_REQUIRE(bushd_identify_window(id, identify.salt, identify.windows) < identify.windows);
  }
  bushd_set_address address;
  if (decoded(payload, &address, bushd_decode_set_address, bushd_encode_set_address)) {
    BUSHD_REQUIRE(address.address != BUSHD_ADDRESS_BROADCAST);
  }
  bushd_configure configure;
  if (decoded(payload, &configure, bushd_decode_configure, bushd_encode_configure)) {
    BUSHD_REQUIRE(configure.tick_ns >= BUSHD_MIN_TICK_NS && configure.tick_ns <= BUSHD_MAX_TICK_NS);
    BUSHD_REQUIRE(configure.format == BUSHD_FORMAT_COARSE || configure.format == BUSHD_FORMAT_FINE);
    BUSHD_REQUIRE(configure.comm_timeout_ticks >= 1);
  }
  bushd_table_begin begin;
  if (decoded(payload, &begin, bushd_decode_table_begin, bushd_encode_table_begin)) {
    BUSHD_REQUIRE(begin.bank <= BUSHD_SCRATCH_BANK && begin.accel_count >= 1);
    BUSHD_REQUIRE(begin.cruise >= 1 && begin.time_unit_ns >= 1);
  }
  bushd_table_data data;
  const auto encode_data = [](const bushd_table_data* message, std::uint8_t* out) {
    std::array<std::uint16_t, BUSHD_TABLE_DATA_MAX_CODES> codes;
    for (std::size_t i = 0; i < message->count; ++i) {
      codes[i] = bushd_get_u16(message->codes + 2 * i);
    }
    return bushd_encode_table_data(message->bank, message->offset, message->count, codes.data(),
                                   out);
  };
  if (decoded(payload, &data, bushd_decode_table_data, encode_data)) {
    BUSHD_REQUIRE(data.bank <= BUSHD_SCRATCH_BANK && data.count >= 1);
    BUSHD_REQUIRE(data.count <= BUSHD_TABLE_DATA_MAX_CODES);
    BUSHD_REQUIRE(inside(payload, data.codes, 2u * data.count));
  }
  bushd_table_end end;
  if (decoded(payload, &end, bushd_decode_table_end, bushd_encode_table_end)) {
    BUSHD_REQUIRE(end.bank <= BUSHD_SCRATCH_BANK);
  }
  bushd_assign assign;
  if (decoded(payload, &assign, bushd_decode_assign, bushd_encode_assign)) {
    BUSHD_REQUIRE(assign.motor < BUSHD_MOTORS_PER_MCU && assign.bank < BUSHD_TABLE_BANKS);
  }
  bushd_control control;
  if (decoded(payload, &control, bushd_decode_control, bushd_encode_control)) {
    BUSHD_REQUIRE(control.actions < 16 && (control.actions & 3) != 3);
  }
  bushd_set_position position;
  if (decoded(payload, &position, bushd_decode_set_position, bushd_encode_set_position)) {
    BUSHD_REQUIRE(position.motor < BUSHD_MOTORS_PER_MCU);
  }
  bushd_set_inputs inputs;
  if (decoded(payload, &inputs, bushd_decode_set_inputs, bushd_encode_set_inputs)) {
    BUSHD_REQUIRE(inputs.emergency <= BUSHD_EMERGENCY_INPUT_DISABLE);
    BUSHD_REQUIRE(inputs.debounce_ticks <= BUSHD_MAX_DEBOUNCE_TICKS);
  }
  bushd_motor_inputs motor_inputs;
  if (decoded(payload, &motor_inputs, bushd_decode_motor_inputs, bushd_encode_motor_inputs)) {
    BUSHD_REQUIRE(motor_inputs.motor < BUSHD_MOTORS_PER_MCU);
    BUSHD_REQUIRE(motor_inputs.positive < BUSHD_MOTORS_PER_MCU);
    BUSHD_REQUIRE(motor_inputs.negative < BUSHD_MOTORS_PER_MCU);
    BUSHD_REQUIRE(motor_inputs.home < BUSHD_MOTORS_PER_MCU);
  }
  bushd_currents currents;
  if (decoded(payload, &currents, bushd_decode_currents, bushd_encode_currents)) {
    BUSHD_REQUIRE(currents.motor < BUSHD_MOTORS_PER_MCU);
    BUSHD_REQUIRE(currents.ramp_ma <= BUSHD_MAX_CURRENT_MA);
    BUSHD_REQUIRE((currents.cruise_ma == 0) == (currents.hold_ma == 0));
  }
  bushd_set_outputs outputs;
  if (decoded(payload, &outputs, bushd_decode_set_outputs, bushd_encode_set_outputs)) {
    BUSHD_REQUIRE(outputs.enabled == BUSHD_ENABLED_HIGH || outputs.enabled == BUSHD_ENABLED_LOW);
  }
  bushd_set_velocity velocity;
  if (decoded(payload, &velocity, bushd_decode_set_velocity, bushd_encode_set_velocity)) {
    BUSHD_REQUIRE(velocity.motor < BUSHD_MOTORS_PER_MCU && velocity.most <= BUSHD_VELOCITY_MOST);
    BUSHD_REQUIRE(velocity.least <= velocity.most);
    BUSHD_REQUIRE((velocity.most == 0) == (velocity.acceleration == 0));
  }
  bushd_home home;
  if (decoded(payload, &home, bushd_decode_home, bushd_encode_home)) {
    BUSHD_REQUIRE(home.motor < BUSHD_MOTORS_PER_MCU && home.direction * home.direction == 1);
    BUSHD_REQUIRE(home.most_steps <= INT32_MAX && home.slow_steps - 1 < INT32_MAX);
  }
  bushd_local local;
  decoded(payload, &local, bushd_decode_local, bushd_encode_local);
  bushd_emergency emergency;
  if (decoded(payload, &emergency, bushd_decode_emergency, bushd_encode_emergency)) {
    BUSHD_REQUIRE(emergency.mode <= BUSHD_STOP_DISABLE);
  }
  bushd_emission emission;
  if (decoded(payload, &emission, bushd_decode_emission, bushd_encode_emission)) {
    BUSHD_REQUIRE(emission.mode <= BUSHD_EMISSION_COMMON_STAGGERED &&
                  emission.sequence <= BUSHD_PHASES_THREE);
  }
  bushd_sync sync;
  if (decoded(payload, &sync, bushd_decode_sync, bushd_encode_sync)) {
    BUSHD_REQUIRE(sync.sync_ns < BUSHD_MAX_TICK_NS);
  }
}

void decode_poll(Bytes payload) {
  std::array<bushd_poll_entry, 256> entries;
  const auto encode = [&](const bushd_poll* message, std::uint8_t* out) {
    BUSHD_REQUIRE(inside(payload, message->entries, BUSHD_POLL_ENTRY * message->count));
    for (std::size_t i = 0; i < message->count; ++i) {
      const std::uint8_t* const at = message->entries + BUSHD_POLL_ENTRY * i;
      entries[i] = {at[0], bushd_get_u16(at + 1), at[3], at[4]};
    }
    return bushd_encode_poll(entries.data(), message->count, out);
  };
  bushd_poll poll;
  if (!decoded(payload, &poll, bushd_decode_poll, encode)) return;
  BUSHD_REQUIRE(poll.count >= 1 && poll.count <= BUSHD_POLL_MAX_ENTRIES);
  bushd_poll_entry found;
  const std::uint8_t address = entries[poll.count - 1u].address;
  BUSHD_REQUIRE(bushd_poll_find(&poll, address, &found) && found.address == address);
}

void decode_ticks(Bytes payload) {
  const auto width = [](const bushd_ticks* message) -> std::size_t {
    return (message->flags & BUSHD_TICKS_FINE) != 0 ? 2 : 1;
  };
  const auto encode = [&](const bushd_ticks* message, std::uint8_t* out) {
    std::array<std::uint16_t, BUSHD_MOTORS_PER_MCU> delays;
    BUSHD_REQUIRE(inside(payload, message->delays, 2u * message->motors));
    for (std::size_t i = 0; i < message->motors; ++i) {
      delays[i] = bushd_get_u16(message->delays + 2 * i);
    }
    const std::size_t head =
        bushd_encode_ticks_head(message->epoch, message->flags, message->first_tick, message->count,
                                message->mask, delays.data(), out);
    const std::size_t size = width(message) * message->count * message->motors;
    BUSHD_REQUIRE(inside(payload, message->displacements, size));
    std::memcpy(out + head, message->displacements, size);
    return head + size;
  };
  bushd_ticks ticks;
  if (!decoded(payload, &ticks, bushd_decode_ticks, encode)) return;
  BUSHD_REQUIRE(ticks.count >= 1 && ticks.mask != 0);
  BUSHD_REQUIRE(ticks.motors == std::popcount(ticks.mask));
  BUSHD_REQUIRE((ticks.flags & 6) != 6 && ticks.flags < 8);
  BUSHD_REQUIRE(ticks.count <= bushd_ticks_capacity(ticks.motors, width(&ticks) == 2));
}

// What a table makes of a state that nobody vouches for: it is refused, or no step is faster than
// the table's next and both formats count the same steps.
void take_up(const bushd_run_state& state) {
  static constexpr std::array<std::uint16_t, 6> kUp{{250, 200, 120, 120, 60, 40}};
  static constexpr std::array<std::uint16_t, 4> kDown{{300, 150, 70, 30}};
  static constexpr bushd_table kTable{{kUp.data(), kUp.size(), nullptr, nullptr, 0},
                                      {kDown.data(), kDown.size(), nullptr, nullptr, 0},
                                      45,
                                      10000};
  constexpr std::uint32_t kTickNs = 2560000;
  constexpr std::size_t kTicks = 64;
  bushd_run run;
  if (!bushd_run_restore(&run, &kTable, &state)) return;
  BUSHD_REQUIRE(run.direction == state.direction && !bushd_run_done(&run));
  BUSHD_REQUIRE(bushd_run_delay(&run) >= kTable.cruise);
  bushd_run fine = run;
  std::array<std::uint8_t, kTicks> coarse_ticks;
  std::array<std::int16_t, kTicks> fine_ticks;
  bushd_run_expand_coarse(&run, kTickNs, kTicks, coarse_ticks.data(), 1);
  bushd_run_expand_fine(&fine, kTickNs, kTicks, fine_ticks.data(), 1);
  const auto most = bushd_table_max_steps_per_tick(&kTable, kTickNs);
  for (std::size_t n = 0; n < kTicks; ++n) {
    BUSHD_REQUIRE((coarse_ticks[n] & 0x7Fu) <= most);
    BUSHD_REQUIRE(fine_ticks[n] * state.direction >= 0);
  }
  BUSHD_REQUIRE(run.steps_done == fine.steps_done);
}

// A field that is 0 and need not be there may have been sent all the same: then what the encoder
// makes is shorter, and says the same.
void decode_table_ticks(Bytes payload) {
  bushd_table_ticks message;
  std::memset(&message, 0xA5, sizeof message);
  if (bushd_decode_table_ticks(payload.data(), payload.size(), &message) != BUSHD_OK) return;
  BUSHD_REQUIRE(message.count >= 1 && message.mask != 0);
  BUSHD_REQUIRE((message.flags & ~6) == 0 && message.flags != 6);
  BUSHD_REQUIRE(inside(payload, message.entries, message.entries_size));
  std::array<bushd_table_ticks_entry, BUSHD_MOTORS_PER_MCU> entries;
  std::uint8_t motors = 0;
  std::uint16_t mask = 0;
  std::uint16_t at = 0;
  for (bushd_table_ticks_entry entry; bushd_next_table_ticks_entry(&message, &at, &entry);) {
    BUSHD_REQUIRE(motors < BUSHD_MOTORS_PER_MCU && mask < 1 << entry.motor);
    mask = static_cast<std::uint16_t>(mask | 1 << entry.motor);
    entries[motors++] = entry;
    take_up(entry.state);
  }
  BUSHD_REQUIRE(at == message.entries_size && mask == message.mask);
  Payload again;
  const std::size_t size =
      bushd_encode_table_ticks(message.epoch, message.flags, message.first_tick, message.count,
                               entries.data(), motors, again.data());
  BUSHD_REQUIRE(size == payload.size() && same(payload, again, size));
}

void decode_table_run(Bytes payload) {
  std::array<bushd_table_run_entry, BUSHD_MOTORS_PER_MCU> entries;
  const auto encode = [&](const bushd_table_run* message, std::uint8_t* out) {
    BUSHD_REQUIRE(message->count >= 1 && message->count <= BUSHD_MOTORS_PER_MCU);
    const std::uint8_t* at = message->entries;
    for (std::uint8_t i = 0; i < message->count; ++i) {
      entries[i] = bushd_next_table_run_entry(&at);
      BUSHD_REQUIRE(entries[i].steps >= 1 && entries[i].steps <= INT32_MAX);
      BUSHD_REQUIRE(entries[i].bank < BUSHD_TABLE_BANKS);
      BUSHD_REQUIRE(i == 0 || entries[i].motor > entries[i - 1u].motor);
    }
    return bushd_encode_table_run(message->epoch, message->first_tick, entries.data(),
                                  message->count, out);
  };
  bushd_table_run message;
  decoded(payload, &message, bushd_decode_table_run, encode);
}

void decode_lines(Bytes payload) {
  std::array<bushd_line_entry, BUSHD_MOTORS_PER_MCU> entries;
  const auto check = [&](const bushd_line_part& line) {
    BUSHD_REQUIRE(line.count >= 1 && line.count <= BUSHD_MOTORS_PER_MCU);
    BUSHD_REQUIRE(line.bank <= BUSHD_SCRATCH_BANK && line.longest <= INT32_MAX && line.steps >= 1);
    BUSHD_REQUIRE(line.from <= line.longest && line.steps <= line.longest - line.from);
    const std::uint8_t* at = line.entries;
    std::uint64_t sum = 0;
    for (std::uint8_t i = 0; i < line.count; ++i) {
      entries[i] = bushd_next_line_entry(&at);
      sum += entries[i].increment;
      BUSHD_REQUIRE(entries[i].increment >= 1 && entries[i].increment <= line.longest);
      BUSHD_REQUIRE(i == 0 || entries[i].motor > entries[i - 1u].motor);
    }
    BUSHD_REQUIRE(!line.elementary || (line.from == 0 && sum == line.longest));
  };
  bushd_line_run run;
  decoded(payload, &run, bushd_decode_line_run,
          [&](const bushd_line_run* message, std::uint8_t* out) {
            check(message->line);
            return bushd_encode_line_run(message, entries.data(), message->line.count, out);
          });
  bushd_line_trigger trigger;
  decoded(payload, &trigger, bushd_decode_line_trigger,
          [&](const bushd_line_trigger* message, std::uint8_t* out) {
            BUSHD_REQUIRE(message->number != 0 && message->edge != BUSHD_EDGE_NONE);
            check(message->line);
            return bushd_encode_line_trigger(message, entries.data(), message->line.count, out);
          });
}

void decode_trigger(Bytes payload) {
  std::array<bushd_table_run_entry, BUSHD_MOTORS_PER_MCU> entries;
  const auto encode = [&](const bushd_trigger* message, std::uint8_t* out) {
    BUSHD_REQUIRE(message->count <= BUSHD_MOTORS_PER_MCU);
    BUSHD_REQUIRE((message->count == 0) == (message->edge == BUSHD_EDGE_NONE));
    const std::uint8_t* at = message->entries;
    for (std::uint8_t i = 0; i < message->count; ++i) {
      entries[i] = bushd_next_table_run_entry(&at);
      BUSHD_REQUIRE(entries[i].steps >= 1 && entries[i].steps <= INT32_MAX);
      BUSHD_REQUIRE(i == 0 || entries[i].motor > entries[i - 1u].motor);
    }
    return bushd_encode_trigger(message->number, message->edge, message->delay_us, entries.data(),
                                message->count, out);
  };
  bushd_trigger message;
  decoded(payload, &message, bushd_decode_trigger, encode);
  bushd_position_compare compare;
  decoded(payload, &compare, bushd_decode_position_compare, bushd_encode_position_compare);
}

void decode_program(Bytes payload) {
  bushd_program_put put;
  if (decoded(payload, &put, bushd_decode_program_put, bushd_encode_program_put)) {
    BUSHD_REQUIRE(put.count >= 1 && std::uint32_t{put.offset} + put.count <= put.total);
  }
  bushd_program_control control;
  if (decoded(payload, &control, bushd_decode_program_control, bushd_encode_program_control)) {
    BUSHD_REQUIRE((control.number != 0) == (control.action == BUSHD_PROGRAM_RUN));
  }
  bushd_program_state state;
  decoded(payload, &state, bushd_decode_program_state, bushd_encode_program_state);
  // The payload as a program: whoever has checked it reads it whole, frame by frame.
  bushd_program program;
  if (bushd_program_check(payload.data(), payload.size(), UINT16_MAX, &program) != BUSHD_OK) return;
  BUSHD_REQUIRE(program.motors != 0 && program.end == payload.data() + payload.size());
  const std::uint8_t* at = program.frames;
  for (bool ended = false; !ended;) {
    BUSHD_REQUIRE(at < program.end);
    const bushd_program_frame frame = bushd_next_program_frame(&program, &at);
    ended = frame.kind == BUSHD_PROGRAM_END;
    BUSHD_REQUIRE((frame.motors & ~program.motors) == 0);
    for (std::uint16_t point = 0; point < frame.points; ++point) {
      for (std::uint8_t nth = 0; nth < frame.motor_count; ++nth) {
        bushd_program_entry_of(&frame, point, nth);
      }
    }
  }
  BUSHD_REQUIRE(at == program.end);
}

// It goes on from what is known, here nothing but how many motors there are.
void decode_report(Bytes payload) {
  bushd_report report{};
  report.motor_count = BUSHD_MOTORS_PER_MCU;
  const bushd_status status = bushd_decode_report(payload.data(), payload.size(), &report);
  BUSHD_REQUIRE(status == BUSHD_OK || status == BUSHD_E_LENGTH || status == BUSHD_E_FORMAT);
  if (status != BUSHD_OK) return;
  Payload again;
  BUSHD_REQUIRE(same(payload, again, bushd_encode_report(&report, again.data())));
  BUSHD_REQUIRE(report.state <= BUSHD_STATE_FAULT);
  BUSHD_REQUIRE(report.motor_count <= BUSHD_MOTORS_PER_MCU);
  BUSHD_REQUIRE(payload.size() == bushd_report_size(report.sections, report.motors));
  if (bushd_report_is_whole(&report)) {
    BUSHD_REQUIRE(payload.size() == BUSHD_REPORT_SIZE(report.motor_count));
  }
}

void decode_for_master(Bytes payload) {
  bushd_identity identity;
  std::memset(&identity, 0xA5, sizeof identity);
  if (!payload.empty() && payload[0] != BUSHD_PROTOCOL_VERSION) {
    BUSHD_REQUIRE(bushd_decode_identity(payload.data(), payload.size(), &identity) == BUSHD_OK);
    BUSHD_REQUIRE(identity.protocol_version == payload[0] && identity.motors == 0);
  } else if (decoded(payload, &identity, bushd_decode_identity, bushd_encode_identity)) {
    BUSHD_REQUIRE(identity.motors >= 1 && identity.motors <= BUSHD_MOTORS_PER_MCU);
  }
  decode_report(payload);
  bushd_tables tables;
  decoded(payload, &tables, bushd_decode_tables, bushd_encode_tables);
  bushd_acknowledgement acknowledgement;
  decoded(payload, &acknowledgement, bushd_decode_acknowledgement, bushd_encode_acknowledgement);
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > BUSHD_FRAME_MAX_PAYLOAD) return 0;
  const std::span payload(data, size);
  bushd::fuzz::decode_for_mcu(payload);
  bushd::fuzz::decode_poll(payload);
  bushd::fuzz::decode_ticks(payload);
  bushd::fuzz::decode_table_ticks(payload);
  bushd::fuzz::decode_table_run(payload);
  bushd::fuzz::decode_lines(payload);
  bushd::fuzz::decode_trigger(payload);
  bushd::fuzz::decode_program(payload);
  bushd::fuzz::decode_for_master(payload);
  return 0;
}

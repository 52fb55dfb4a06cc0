// What a slave does about its program, which moves nothing: a test says how it goes on.
#include "bus/rs485/slave.h"

namespace bushd::test {

std::uint8_t FakeBus::put_program(Slave& slave, const Heard& frame) {
  bushd_program_put part{};
  EXPECT_EQ(bushd_decode_program_put(frame.payload.data(), frame.payload.size(), &part), BUSHD_OK);
  bushd_program_state& state = slave.program_state;
  if (slave.runs_program()) return BUSHD_E_STATE;
  if (part.total > state.memory) return BUSHD_E_CAPACITY;
  if (part.offset > (part.offset == 0 ? 0 : slave.program.size())) return BUSHD_E_STATE;
  slave.program.resize(part.offset);
  slave.program.insert(slave.program.end(), part.bytes, part.bytes + part.count);
  state.stage = BUSHD_PROGRAM_LOADING;
  state.size = static_cast<std::uint16_t>(slave.program.size());
  return BUSHD_OK;
}

std::uint8_t FakeBus::control_program(Slave& slave, const Heard& frame) {
  bushd_program_control message{};
  EXPECT_EQ(bushd_decode_program_control(frame.payload.data(), frame.payload.size(), &message),
            BUSHD_OK);
  bushd_program_state& state = slave.program_state;
  const auto from_to = [&](std::uint8_t from, std::uint8_t to) -> std::uint8_t {
    if (state.stage != from && state.stage != to) return BUSHD_E_STATE;
    state.stage = to;
    return BUSHD_OK;
  };
  switch (message.action) {
    case BUSHD_PROGRAM_COMMIT:
      state.crc = ~bushd_crc32(BUSHD_CRC32_START, slave.program.data(), slave.program.size());
      if (state.crc != message.value) return BUSHD_E_CRC;
      return from_to(BUSHD_PROGRAM_LOADING, BUSHD_PROGRAM_LOADED);
    case BUSHD_PROGRAM_RUN:
      if (state.number == message.number) return BUSHD_OK;
      if (state.stage == BUSHD_PROGRAM_ENDED) state.stage = BUSHD_PROGRAM_LOADED;
      if (state.stage != BUSHD_PROGRAM_LOADED) return BUSHD_E_STATE;
      state.number = message.number;
      state.start_tick = message.value;
      state.stage = BUSHD_PROGRAM_RUNS;
      return BUSHD_OK;
    case BUSHD_PROGRAM_STOP:
      if (slave.runs_program()) state.stage = BUSHD_PROGRAM_ENDED;
      state.reason = BUSHD_PROGRAM_STOPPED;
      return BUSHD_OK;
    case BUSHD_PROGRAM_PAUSE:
      return from_to(BUSHD_PROGRAM_RUNS, BUSHD_PROGRAM_PAUSED);
    case BUSHD_PROGRAM_RESUME:
      return from_to(BUSHD_PROGRAM_PAUSED, BUSHD_PROGRAM_RUNS);
    default:
      if (slave.runs_program()) return BUSHD_E_STATE;
      state.stage = BUSHD_PROGRAM_NONE;
      slave.program.clear();
      return BUSHD_OK;
  }
}

}  // namespace bushd::test

// All decoders of messages, those of the MCU and those of the master, on one payload: what is
// accepted keeps the ranges that engine/message.h promises, is what the encoder makes of it, and
// can be used.
#include <algorithm>
#include <array>
#include <span>
#include <string>

#include "engine/message.h"
#include "engine/message_kinds.h"
#include "engine/program.h"
#include "engine/run_state.h"
#include "fuzz/fuzz.h"

namespace bushd::fuzz {
namespace {

using Bytes = std::span<const std::uint8_t>;

void decode(const std::string& name, const test::Kind& kind, Bytes payload) {
  const test::Decoded message = kind.decode(payload, false);
  if (message.status != BUSHD_OK) {
    BUSHD_REQUIRE(message.status == BUSHD_E_LENGTH || message.status == BUSHD_E_FORMAT);
    return;
  }
  if (!message.out_of_range.empty())
    broken((name + ": " + message.out_of_range).c_str(), __FILE__, __LINE__);
  const bool of_other_version = name == "identity" && payload[0] != BUSHD_PROTOCOL_VERSION;
  BUSHD_REQUIRE(of_other_version || std::ranges::equal(message.reencoded, payload));
}

// One of another version is taken, whatever else it has.
void use_identity(Bytes payload) {
  if (payload.empty() || payload[0] == BUSHD_PROTOCOL_VERSION) return;
  bushd_identity identity;
  BUSHD_REQUIRE(bushd_decode_identity(payload.data(), payload.size(), &identity) == BUSHD_OK);
  BUSHD_REQUIRE(identity.protocol_version == payload[0] && identity.motors == 0);
}

void use_identify(Bytes payload) {
  bushd_identify identify;
  if (bushd_decode_identify(payload.data(), payload.size(), &identify) != BUSHD_OK) return;
  const std::uint8_t id[BUSHD_UNIQUE_ID_SIZE] = {1, 2, 3, 4, 5, 6, 7, 8};
  BUSHD_REQUIRE(bushd_identify_window(id, identify.salt, identify.windows) < identify.windows);
}

void use_poll(Bytes payload) {
  bushd_poll poll;
  if (bushd_decode_poll(payload.data(), payload.size(), &poll) != BUSHD_OK) return;
  bushd_poll_entry found;
  const std::uint8_t address = poll.entries[BUSHD_POLL_ENTRY * (poll.count - 1u)];
  BUSHD_REQUIRE(bushd_poll_find(&poll, address, &found) && found.address == address);
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

void use_table_ticks(Bytes payload) {
  bushd_table_ticks message;
  if (bushd_decode_table_ticks(payload.data(), payload.size(), &message) != BUSHD_OK) return;
  std::uint16_t at = 0;
  for (bushd_table_ticks_entry entry; bushd_next_table_ticks_entry(&message, &at, &entry);) {
    take_up(entry.state);
  }
}

// The payload as a program: whoever has checked it reads it whole, frame by frame.
void use_program(Bytes payload) {
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

void use_report(Bytes payload) {
  bushd_report report{};
  report.motor_count = BUSHD_MOTORS_PER_MCU;
  if (bushd_decode_report(payload.data(), payload.size(), &report) != BUSHD_OK) return;
  BUSHD_REQUIRE(report.motor_count <= BUSHD_MOTORS_PER_MCU);
  BUSHD_REQUIRE(payload.size() == bushd_report_size(report.sections, report.motors));
  if (bushd_report_is_whole(&report)) {
    BUSHD_REQUIRE(payload.size() == BUSHD_REPORT_SIZE(report.motor_count));
  }
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > BUSHD_FRAME_MAX_PAYLOAD) return 0;
  const std::span payload(data, size);
  for (const auto& [name, kind] : bushd::test::message_kinds()) {
    bushd::fuzz::decode(name, kind, payload);
  }
  bushd::fuzz::use_identity(payload);
  bushd::fuzz::use_identify(payload);
  bushd::fuzz::use_poll(payload);
  bushd::fuzz::use_table_ticks(payload);
  bushd::fuzz::use_program(payload);
  bushd::fuzz::use_report(payload);
  return 0;
}

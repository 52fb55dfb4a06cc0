// Any text as the file of a program: bytes that an MCU takes and a walk through them, or an error
// that says why.
#include <algorithm>
#include <string_view>
#include <vector>

#include "engine/program.h"
#include "fuzz/fuzz.h"
#include "fuzz/fuzz_table.h"
#include "programs/compile.h"
#include "tables/any_line.h"

namespace bushd::fuzz {
namespace {

constexpr const char* kEnvelope =
    "table = \"fuzz\"\nby = \"distance\"\nzones = [[0, 100], [30, 200]]\nend = 50\n";
constexpr std::size_t kMostFrames = 2000;  // of a walk: repeats are the engine's

void run(std::string_view text) {
  const auto program = programs::parse(text, "fuzz.toml", [](const std::string& file) {
    return Result<std::string>(file.ends_with(".envelope") ? kEnvelope : "a, b\n1, 2\n3, 4\n");
  });
  if (!program) {
    BUSHD_REQUIRE(!program.error().message.empty());
    return;
  }
  programs::McuPlace mcu{.name = "MCU 1",
                         .memory = 4096,
                         .tick_ns = 2'560'000,
                         .line_bank = 7,
                         .line_table = &fuzz_table()};
  std::vector<programs::MotorPlace> motors;
  for (const std::string& name : program->motors) {
    programs::MotorPlace motor;
    motor.name = name;
    motor.output = static_cast<std::uint8_t>(motors.size());
    motor.table = &fuzz_table();
    motors.push_back(std::move(motor));
  }
  tables::TablePtr codes;
  if (program->codes) {
    auto made = tables::make_any_law(*program->codes);
    if (!made) return;
    codes = *made;
    mcu.line_table = &codes->view();
  }
  const auto bytes = programs::compile(*program, mcu, motors);
  if (!bytes) {
    BUSHD_REQUIRE(!bytes.error().text().empty());
    return;
  }
  bushd_program read;
  BUSHD_REQUIRE(bytes->size() <= mcu.memory);
  BUSHD_REQUIRE(bushd_program_check(bytes->data(), bytes->size(), UINT16_MAX, &read) == BUSHD_OK);
  const auto walk = programs::rehearse(*program, mcu, motors, *bytes, kMostFrames);
  if (!walk) return;
  for (const programs::Rehearsal::Way& way : walk->motors) {
    BUSHD_REQUIRE(way.least_steps <= way.end_steps && way.end_steps <= way.most_steps);
  }
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  bushd::fuzz::run({reinterpret_cast<const char*>(data), size});
  return 0;
}

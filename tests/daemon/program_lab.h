// A lab with programs in its MCUs.
#pragma once

#include <string>
#include <vector>

#include "daemon/lab.h"
#include "daemon/step_times.h"

namespace bushd::test {

// With these keys in each [[mcu]].
inline std::string hall_with(int mcus, int motors, const std::string& keys) {
  std::string toml = hall(mcus, motors);
  for (int mcu = 1; mcu <= mcus; ++mcu) toml = with_mcu_keys(toml, keys, mcu);
  return toml;
}

// Programs of its MCUs may go on without a host, if `without_host`.
inline std::string hall_of_programs(int mcus, int motors, bool without_host = false) {
  return hall_with(mcus, motors, without_host ? "programs_without_host = true\n" : "");
}

struct ProgramLab : Lab {
  explicit ProgramLab(const std::string& toml, bool keeps = false)
      : Lab(toml, {}, &steps, 0, keeps) {
    connect();
  }
  ProgramLab() : ProgramLab(hall_of_programs(2, 2)) {}

  static api::PutProgram put_of(const std::string& name, const std::string& motors,
                                const std::string& frames, const std::string& head = {}) {
    return {.program = name,
            .text = "motors = [" + motors + "]\nunit = \"steps\"\n" + head + frames};
  }
  Answer put(const std::string& name, const std::string& motors, const std::string& frames,
             const std::string& head = {}) {
    return ask(put_of(name, motors, frames, head));
  }
  std::int64_t run(const std::vector<std::string>& programs) {
    return send(api::RunPrograms{programs});
  }
  api::ProgramEntry entry(std::size_t index = 0) {
    const std::vector<api::ProgramEntry> all = ask(api::ListPrograms{}).programs;
    return index < all.size() ? all[index] : api::ProgramEntry{};
  }
  bool comes_to(const std::string& stage) {
    return run_until([&] { return entry().stage == stage; });
  }

  StepTimes steps;
};

// One step forth and back, for ever.
inline constexpr const char* kToAndFro =
    "[[frame]]\nrepeat = 0\n[[frame]]\nmove_by = [40]\n[[frame]]\nmove_by = [-40]\n"
    "[[frame]]\nnext = true\n";

}  // namespace bushd::test

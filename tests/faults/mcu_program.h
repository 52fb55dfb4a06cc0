// Programs of MCUs that clients put and run, and where one leads: as numbers, and as the text that
// the daemon reads.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace bushfaults {

struct McuProgram {
  struct Frame {
    enum class Kind : std::uint8_t {
      kMoveBy,
      kMoveTo,
      kLineBy,
      kLineTo,
      kWait,
      kPulse,
      kRepeat,
      kNext
    };
    Kind kind{};
    std::vector<std::int64_t> steps{};  // of motions: row by row, one for each motor
    std::int64_t number = 0;            // milliseconds of a wait, microseconds of a pulse, repeats
    std::int64_t steps_per_s = 0;       // of motions, at most; 0: as tables allow
    bool elementary = false;            // a line
  };

  std::string name{};
  std::vector<std::string> motors{};
  std::vector<Frame> frames{};
  bool without_host = false;
  bool dry_run = false;

  // A motion comes so soon after another one, or is one of a line, that its table alone does not
  // say how close its steps may be to those before (sim/pace.h).
  bool is_like_line() const;
  std::string text() const;
  // Where it leads, motor by motor, from there; positions are those of the daemon's count, and
  // `zero` is where that has its 0. Nothing of a program that does not end.
  std::vector<std::int64_t> end(std::vector<std::int64_t> from,
                                const std::vector<std::int64_t>& zero) const;
  bool has_positions() const;
  bool ends() const;
};

}  // namespace bushfaults

// Envelopes of moves (docs/tables.md, Envelopes): a file NAME.envelope says from where on a motor
// is how fast, where that ends, and by which table it changes its speed.
//
//     table = "feed"
//     by = "distance"                              # from where the motion begins; or "position"
//     zones = [[0, 1000], [1000, 2500], [2500, 500]]      # from there on, at most so fast
//     end = 3000
//     steps_per_unit = 400                         # left out: numbers are steps, and steps/s
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"
#include "engine/table.h"

namespace bushd::tables {

struct SpeedZones {
  static constexpr std::size_t kMostZones = 100;
  static constexpr double kMostSteps = 2147483647;  // MCUs count positions in 32 bits
  enum class By { kDistance, kPosition };
  struct Zone {
    double from = 0;
    double speed = 0;  // per second
    friend bool operator==(const Zone&, const Zone&) = default;
  };

  std::string description{};
  std::string table{};
  By by = By::kDistance;
  std::optional<double> steps_per_unit{};  // none: all numbers are steps
  std::vector<Zone> zones{};               // all in the direction of the end; by distance from 0 on
  double end = 0;

  double steps_of(double units) const { return units * steps_per_unit.value_or(1); }
  friend bool operator==(const SpeedZones&, const SpeedZones&) = default;
};

// A name without '/' and ".envelope" is that of NAME.envelope in the directory.
std::filesystem::path envelope_path(std::string_view envelope,
                                    const std::filesystem::path& directory);

// `file` is what errors say. Errors name line, key, cause and what is allowed.
Result<SpeedZones> parse_zones(std::string_view text, const std::string& file);
Result<SpeedZones> load_zones(const std::filesystem::path& path);
// A file that parse_zones takes for the same.
std::string to_text(const SpeedZones& zones);

// Whether a table, that of this name, is as fast as all zones. The error names the first that is
// faster.
Result<void> check_speeds(const SpeedZones& zones, const bushd_table& table);

}  // namespace bushd::tables

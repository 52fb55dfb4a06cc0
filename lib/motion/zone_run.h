// The run of an envelope (tables/speed_zones.h): a path of one motor from rest to rest, with a
// speed for each of its segments.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "engine/table.h"
#include "motion/path_segment.h"
#include "tables/speed_zones.h"
#include "words/table_content.h"

namespace bushd::motion {

struct ZoneRun {
  struct Part {
    std::uint32_t steps = 0;  // that end in this zone
    std::uint64_t end_ns = 0;
  };
  std::uint32_t unit_ns = 1;
  bool negative = false;      // towards falling numbers
  Profile delays{};           // of all steps, in units
  std::vector<Part> parts{};  // by zone

  std::uint32_t steps() const;
  std::uint64_t end_ns() const { return parts.empty() ? 0 : parts.back().end_ns; }
};

// From where the first zone begins. `shortest_delay`: none of its steps has a shorter one, in units
// of the table. Precondition: the table passed bushd_table_check. Errors: a zone without a step, a
// speed that the table does not have, or that is slower than a step an hour.
Result<ZoneRun> zone_run(const tables::SpeedZones& zones, const bushd_table& table,
                         bushd_delay shortest_delay = 0);

// Its delays as codes as they are written (bushd_run_start_as_written): the longest part of equal
// delays is the cruise. Errors: one step only, a delay above 65535 units, more codes than an MCU
// addresses.
Result<words::TableContent> written_codes(const ZoneRun& run, const std::string& name);

}  // namespace bushd::motion

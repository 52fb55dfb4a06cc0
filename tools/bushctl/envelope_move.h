// A move by an envelope (tables/speed_zones.h): a path of one motor, with a speed to each point.
#pragma once

#include <string>
#include <vector>

#include "api/request.h"
#include "base/result.h"
#include "tables/speed_zones.h"
#include "tables/table.h"
#include "where.h"

namespace bushctl {

// An envelope with its table, which lies beside it or is shipped.
struct EnvelopeFile {
  std::string file{};
  bushd::tables::SpeedZones zones{};
  bushd::tables::TablePtr table{};
};
// A name is that of a file in the machine's folder of tables. Errors: what is wrong with a file, a
// speed that the table does not have.
bushd::Result<EnvelopeFile> read_envelope(const std::string& envelope);

// Errors: the motor has another table or another scale than the envelope; by distance also a motor
// that moves, or whose position nobody knows.
bushd::Result<std::vector<bushd::api::MovePath>> envelope_path(const EnvelopeFile& envelope,
                                                               const Whereabouts& motor,
                                                               const std::string& speed);

}  // namespace bushctl

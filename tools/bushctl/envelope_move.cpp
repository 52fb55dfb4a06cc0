#include "envelope_move.h"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <utility>

#include "base/units/coordinates.h"
#include "move_arguments.h"
#include "tables/store/open.h"
#include "tables/table_file.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
namespace tables = bushd::tables;
namespace units = bushd::units;
using bushd::fail;
using bushd::Result;
using tables::SpeedZones;

constexpr double kSameScale = 1e-9;

double steps_per_unit(const units::Scale& scale) {
  return static_cast<double>(scale.steps_per_unit.numerator) /
         static_cast<double>(scale.steps_per_unit.denominator);
}

tl::unexpected<bushd::Error> wrong(const EnvelopeFile& envelope, std::string key,
                                   std::string message) {
  return fail(
      bushd::Error{.message = std::move(message), .file = envelope.file, .key = std::move(key)});
}

Result<void> fits(const EnvelopeFile& envelope, const Whereabouts& motor) {
  const api::MotorDescription& is = motor.description;
  if (is.table.name != envelope.table->name() || is.table.hash != envelope.table->short_hash()) {
    return wrong(envelope, "table",
                 fmt::format("is \"{}\", content {}, and {} goes by \"{}\", content {}; draw it "
                             "by that table, or put the other one in service",
                             envelope.table->name(), envelope.table->short_hash(), is.name,
                             is.table.name, is.table.hash));
  }
  if (!envelope.zones.steps_per_unit) return {};
  const double own = steps_per_unit(is.scale);
  const double wanted = *envelope.zones.steps_per_unit;
  if (is.scale.unit != units::Coordinates::kSteps && std::fabs(own / wanted - 1) < kSameScale)
    return {};
  return wrong(envelope, "steps_per_unit",
               fmt::format("is {:.10g}, and {} has {} per {}; write an envelope for this motor",
                           wanted, is.name, to_text(is.scale.steps_per_unit), is.scale.unit));
}

Result<void> stands(const Whereabouts& motor) {
  const api::MotorState& state = motor.state;
  if (state.trust == api::Trust::kUnknown) {
    return fail(state.name + ": nobody knows where it stands; wait until its MCU is online");
  }
  if (!state.moving) return {};
  return fail(state.name +
              " moves, and an envelope by distance begins at rest; stop it, or wait for its end");
}

}  // namespace

Result<EnvelopeFile> read_envelope(const std::string& envelope) {
  const std::filesystem::path path = tables::envelope_path(envelope, tables::store::kMachineTables);
  auto zones = tables::load_zones(path);
  if (!zones) return fail(zones.error());
  std::vector<tables::store::Place> places{tables::store::place_of(
      path.has_parent_path() ? path.parent_path() : std::filesystem::path("."))};
  for (const auto& shipped : tables::shipped_directories()) {
    places.push_back(tables::store::place_of(shipped));
  }
  auto table = tables::store::open(zones->table, places);
  if (!table) return fail(table.error());
  if (auto fast = tables::check_speeds(*zones, (*table)->view()); !fast) {
    bushd::Error error = fast.error();
    error.file = path.string();
    return fail(error);
  }
  return EnvelopeFile{path.string(), std::move(*zones), std::move(*table)};
}

Result<std::vector<api::MovePath>> envelope_path(const EnvelopeFile& envelope,
                                                 const Whereabouts& motor,
                                                 const std::string& speed) {
  const SpeedZones& zones = envelope.zones;
  if (auto fit = fits(envelope, motor); !fit) return fail(fit.error());
  const bool by_distance = zones.by == SpeedZones::By::kDistance;
  if (by_distance) {
    if (auto rests = stands(motor); !rests) return fail(rests.error());
  }
  const auto not_faster = parse_speed(speed, Numbers::kUser);
  if (!not_faster) return fail(not_faster.error());
  const auto own = units::Coordinates::make(motor.description.scale);
  if (!own) return fail(own.error());
  // In steps also of a motor with a unit.
  const units::Coordinates plain;
  const units::Coordinates& scale = zones.steps_per_unit ? *own : plain;
  const double speed_factor =
      zones.steps_per_unit ? 1 : 1 / steps_per_unit(motor.description.scale);
  api::MovePath path{.motors = {motor.state.name}, .speed = *not_faster};
  const auto add = [&](double place, double to_there) -> Result<void> {
    const auto steps = by_distance ? scale.steps_of_distance(place) : scale.steps_of_user(place);
    if (!steps) return fail(steps.error());
    path.positions.push_back(own->user_of(*steps + (by_distance ? motor.state.position_steps : 0)));
    path.speeds.push_back(to_there * speed_factor);
    return {};
  };
  // By position there is a way to the first zone.
  if (!by_distance) {
    if (auto added = add(zones.zones.front().from, 0); !added) return fail(added.error());
  }
  for (std::size_t i = 0; i < zones.zones.size(); ++i) {
    const bool last = i + 1 == zones.zones.size();
    const double to = last ? zones.end : zones.zones[i + 1].from;
    if (auto added = add(to, zones.zones[i].speed); !added) return fail(added.error());
  }
  path.rows = static_cast<std::int32_t>(path.positions.size());
  return std::vector{path};
}

}  // namespace bushctl

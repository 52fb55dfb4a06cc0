#include "program_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/printable.h"
#include "base/units/coordinates.h"
#include "grid.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
namespace units = bushd::units;
using bushd::client::Status;

constexpr double kSPerUs = 1e-6;
constexpr const char* kLoading = "loading";

// Steps, where nothing is known of the motor.
units::Coordinates coordinates_of(const Status& status, const std::string& motor) {
  for (const auto& mcu : status.descriptions) {
    const auto& motors = mcu.snapshot.motors;
    const auto found = std::ranges::find(motors, motor, &api::MotorDescription::name);
    if (found == motors.end()) continue;
    return units::Coordinates::make(found->scale).value_or(units::Coordinates());
  }
  return {};
}

// Where it comes to, low before high on the scale of people.
std::string way_of(const api::ProgramEntry::Motor& motor, const units::Coordinates& coordinates) {
  std::int64_t low = motor.least_steps;
  std::int64_t high = motor.most_steps;
  if (coordinates.scale().negative) std::swap(low, high);
  return fmt::format("{}: between {} and {}, ends at {}, {} steps", bushd::printable(motor.motor),
                     bushd::printable(coordinates.text(low)),
                     bushd::printable(coordinates.text(high)),
                     bushd::printable(coordinates.text(motor.end_steps)), motor.edges);
}

std::string duration_text(const api::ProgramEntry& program) {
  if (program.motors.empty()) return "-";
  return fmt::format("{:.3f} s{}", static_cast<double>(program.duration_us) * kSPerUs,
                     program.endless ? " a pass" : "");
}

const char* kept_text(const api::ProgramEntry& program) {
  if (program.stage == "none") return "outlives power cuts, once it is put";
  return program.stored
             ? "outlives power cuts"
             : "does not outlive a power cut yet: its MCU writes it when its motors rest";
}

std::string frame_text(const api::ProgramEntry& program) {
  if (program.frame == 0) return "-";
  if (program.point == 0) return fmt::to_string(program.frame);
  return fmt::format("{}, point {}", program.frame, program.point);
}

}  // namespace

std::vector<std::string> lines(const api::ProgramEntry& program, const Status& status) {
  std::vector<std::string> out;
  out.push_back(fmt::format("{} on {}: {} of {} bytes, {:.3f} s", bushd::printable(program.program),
                            bushd::printable(program.mcu), program.bytes, program.memory,
                            static_cast<double>(program.duration_us) * kSPerUs));
  for (const api::ProgramEntry::Motor& motor : program.motors) {
    out.push_back(way_of(motor, coordinates_of(status, motor.motor)));
  }
  if (program.pulses > 0) {
    out.push_back(fmt::format("{} pulses at the position compare output", program.pulses));
  }
  if (program.endless) out.emplace_back("without end: this is one pass of what it repeats");
  if (program.waits_for_inputs) {
    out.emplace_back("waits for inputs: that time is not in the duration");
  }
  if (program.cut) out.emplace_back("longer than was looked at: this is its beginning");
  if (program.without_host) out.emplace_back("goes on when no host is heard");
  if (program.kept) out.emplace_back(kept_text(program));
  if (program.at_power_on) out.emplace_back("begins by itself when the power comes");
  return out;
}

std::vector<std::string> table(const api::ProgramList& list) {
  using enum Align;
  Grid grid({kLeft, kLeft, kLeft, kLeft, kRight, kRight, kRight, kLeft, kLeft});
  grid.row({"MCU", "PROGRAM", "STAGE", "FRAME", "REPEATS", "BYTES", "DURATION", "CHECKSUM", ""});
  for (const api::ProgramEntry& program : list.programs) {
    std::string notes = bushd::printable(program.reason);
    const auto note = [&notes](bool is, const char* text) {
      if (is) notes += std::string(notes.empty() ? "" : "; ") + text;
    };
    note(program.without_host, "without host");
    note(program.kept, program.stored ? "kept" : "not kept yet");
    note(program.at_power_on, "at power-on");
    grid.row({bushd::printable(program.mcu),
              program.program.empty() ? "-" : bushd::printable(program.program),
              bushd::printable(program.stage), frame_text(program), fmt::to_string(program.repeats),
              fmt::format("{} of {}", program.bytes, program.memory), duration_text(program),
              program.checksum.empty() ? "-" : bushd::printable(program.checksum), notes});
  }
  return grid.lines();
}

std::string upload_text(const api::ProgramList& list, const std::string& program) {
  for (const api::ProgramEntry& entry : list.programs) {
    if (entry.stage != kLoading || entry.program != program) continue;
    return fmt::format("{}: {} bytes have arrived at {}", bushd::printable(program), entry.bytes,
                       bushd::printable(entry.mcu));
  }
  return {};
}

}  // namespace bushctl

#include "daemon/matrix/claims.h"

#include <algorithm>
#include <vector>

#include "base/overloaded.h"
#include "daemon/matrix/watched_lab.h"

namespace bushd::test::matrix {
namespace {

std::set<std::string> named(const std::vector<api::MotorAmount>& amounts) {
  std::set<std::string> names;
  for (const api::MotorAmount& amount : amounts) names.insert(amount.motor);
  return names;
}

// As far as they are motors.
std::set<std::string> named(const api::MotorNames& motors) {
  std::set<std::string> names;
  for (const std::string& motor : motors) {
    if (std::ranges::find(kMotors, motor) != kMotors.end()) names.insert(motor);
  }
  return names;
}

std::set<std::string> all() {
  return {kMotors.begin(), kMotors.end()};
}

std::set<std::string> or_all(const api::MotorNames& motors) {
  return motors.empty() ? all() : named(motors);
}

}  // namespace

Claims claims_of(const api::Request& request) {
  return std::visit(
      Overloaded{
          [](const api::Move& r) {
            return Claims{.moves = r.dry_run ? std::set<std::string>() : named(r.motors)};
          },
          [](const api::MoveLine& r) {
            return Claims{.moves = r.dry_run ? std::set<std::string>() : named(r.motors)};
          },
          [](const api::MovePath& r) {
            return Claims{.moves = r.dry_run ? std::set<std::string>() : named(r.motors)};
          },
          [](const api::Follow& r) {
            return Claims{.moves = r.part == api::Follow::Part::kRun ? named(r.motors)
                                                                     : std::set<std::string>()};
          },
          [](const api::Arm& r) { return Claims{.moves = named(r.motors)}; },
          [](const api::ArmLine& r) { return Claims{.moves = named(r.motors)}; },
          [](const api::Home& r) {
            const std::set<std::string> homed =
                r.all ? std::set<std::string>{"a", "e"} : named(r.motors);
            return Claims{.moves = homed, .places = homed};
          },
          [](const api::Jog& r) {
            // Its end is answered when the motor stands.
            return r.per_s == 0 && !r.renew ? Claims{} : Claims{.moves = {r.motor}};
          },
          [](const api::Stop& r) { return Claims{.stops = or_all(r.motors)}; },
          [](const api::EmergencyStop&) { return Claims{.stops = all()}; },
          // Homing and what waits for the trigger go on; the state tells of those that are paused.
          [](const api::Pause&) { return Claims{}; },
          [](const api::Resume& r) { return Claims{.resumes = or_all(r.motors)}; },
          [](const api::Hold&) { return Claims{}; },
          [](const api::Release&) { return Claims{}; },
          [](const api::SetPosition& r) { return Claims{.places = named(r.motors)}; },
          [](const api::Camac& r) {
            const bool starts = std::ranges::any_of(
                r.block.cycles, [](const camac::Naf& naf) { return naf.function == 26; });
            return starts ? Claims{.programs = {"program", "shutter"}} : Claims{};
          },
          [](const api::Enable&) { return Claims{}; },
          [](const api::Disable&) { return Claims{}; },
          [](const api::ClearFaults&) { return Claims{}; },
          [](const api::UseTable&) { return Claims{}; },
          [](const api::ReloadTables&) { return Claims{}; },
          [](const api::Disarm&) { return Claims{}; },
          [](const api::PositionCompare&) { return Claims{}; },
          [](const api::ListTables&) { return Claims{}; },
          [](const api::GetTable&) { return Claims{}; },
          [](const api::SetTable&) { return Claims{}; },
          [](const api::Confirm& r) { return Claims{.places = named(r.motors)}; },
          [](const api::GetHistory&) { return Claims{}; },
          [](const api::Configure&) { return Claims{}; },
          [](const api::PutProgram&) { return Claims{}; },
          [](const api::EraseProgram&) { return Claims{}; },
          // The rows of requests.cpp name a program as its motor.
          [](const api::RunPrograms& r) { return Claims{.moves = named(r.programs)}; },
          [](const api::ListPrograms&) { return Claims{}; },
      },
      static_cast<const api::Request::variant&>(request));
}

}  // namespace bushd::test::matrix

#include "daemon/matrix/requests.h"

#include <algorithm>
#include <variant>

#include "base/overloaded.h"
#include "daemon/matrix/watched_lab.h"

namespace bushd::test::matrix {
namespace {

using Random = std::mt19937;
using Name = std::string;

std::int64_t some_steps(Random& random) {
  constexpr std::int64_t kWays[] = {1, 25, 300, 2000};
  const std::int64_t way = kWays[random() % 4];
  return random() % 2 == 0 ? way : -way;
}

std::vector<api::MotorAmount> one(const Name& motor, Random& random) {
  return {{motor, some_steps(random)}};
}
std::vector<api::MotorAmount> two(const Name& motor, const Name& other, Random& random) {
  return {{motor, some_steps(random)}, {other, some_steps(random)}};
}

api::MovePath path(const Name& motor, const Name& other, std::int32_t rows, std::int32_t told,
                   Random& random) {
  api::MovePath asked{.motors = {motor, other}, .rows = rows};
  for (std::int32_t row = 0; row < told; ++row) {
    asked.positions.push_back(static_cast<double>(some_steps(random)));
    asked.positions.push_back(static_cast<double>(some_steps(random)));
  }
  return asked;
}

api::Follow trajectory(const Name& motor, const Name& other, api::Follow::Part part) {
  api::Follow asked{.part = part, .array = 3, .motors = {motor, other}};
  if (part == api::Follow::Part::kRun) return asked;
  asked.time_s = {0, 1.5, 3};
  asked.positions = {0, 0, 100, -50, 0, 0};
  return asked;
}

// It has the name of its motor: so claims_of() knows whom it moves.
api::PutProgram program(const Name& motor, Random& random) {
  return {.program = motor,
          .text = "motors = [\"" + motor + "\"]\nunit = \"steps\"\n[[frame]]\nrepeat = 2\n" +
                  "[[frame]]\nmove_by = [" + std::to_string(some_steps(random)) +
                  "]\n[[frame]]\nwait_s = 0.05\n[[frame]]\nnext = true\n"};
}

// Names the motor, where it names any; all else is as without values.
template <class Asked>
api::Request plain(const Name& motor, const Name&, Random& random) {
  Asked asked{};
  if constexpr (requires { asked.motors.front().amount; }) {
    asked.motors = one(motor, random);
  } else if constexpr (requires { asked.motors; }) {
    asked.motors = {motor};
  } else if constexpr (requires { asked.motor; }) {
    asked.motor = motor;
  }
  return asked;
}

template <class Asked>
constexpr bool kOnlyNamesMotors = requires(Asked asked) { asked.motors = api::MotorNames{}; } &&
                                  sizeof(Asked) == sizeof(api::MotorNames);

template <class... Asked>
std::vector<Row> plain_rows(const std::variant<Asked...>* /*requests*/) {
  std::vector<Row> rows;
  const auto add = [&]<class One>(const One*) {
    if constexpr (kOnlyNamesMotors<One>) rows.push_back({One::kName, plain<One>});
  };
  (add(static_cast<const Asked*>(nullptr)), ...);
  return rows;
}

// A type that names motors, and nothing else, needs no row: it has a plain one.
std::vector<Row> with_plain_rows(std::vector<Row> rows) {
  Random random(1);
  std::set<std::size_t> types;
  for (const Row& row : rows) types.insert(row.of("a", "b", random).index());
  for (const Row& row : plain_rows(static_cast<const api::Request::variant*>(nullptr))) {
    if (types.insert(row.of("a", "b", random).index()).second) rows.push_back(row);
  }
  return rows;
}

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

const std::vector<Row>& requests() {
  static const std::vector<Row> kWritten{
      {"move by",
       [](const Name& m, const Name&, Random& r) -> api::Request {
         return api::Move{.motors = one(m, r)};
       }},
      {"move to",
       [](const Name& m, const Name&, Random& r) -> api::Request {
         return api::Move{.kind = api::Move::Kind::kAbsolute, .motors = one(m, r)};
       }},
      {"move two, slowly",
       [](const Name& m, const Name& o, Random& r) -> api::Request {
         return api::Move{.motors = two(m, o, r),
                          .speed = api::Speed{.per_s = 200, .in_steps = true}};
       }},
      {"dry run",
       [](const Name& m, const Name&, Random& r) -> api::Request {
         return api::Move{.motors = one(m, r), .dry_run = true};
       }},
      {"line",
       [](const Name& m, const Name& o, Random& r) -> api::Request {
         return api::MoveLine{.motors = two(m, o, r)};
       }},
      {"path",
       [](const Name& m, const Name& o, Random& r) -> api::Request { return path(m, o, 4, 4, r); }},
      {"path of many points",
       [](const Name& m, const Name& o, Random& r) -> api::Request {
         return path(m, o, 900, 900, r);
       }},
      {"part of a path",
       [](const Name& m, const Name& o, Random& r) -> api::Request { return path(m, o, 6, 3, r); }},
      {"trajectory",
       [](const Name& m, const Name& o, Random&) -> api::Request {
         return trajectory(m, o, api::Follow::Part::kLastRows);
       }},
      {"run of a trajectory",
       [](const Name& m, const Name& o, Random&) -> api::Request {
         return trajectory(m, o, api::Follow::Part::kRun);
       }},
      {"stop", plain<api::Stop>},
      {"stop, named twice",
       [](const Name& m, const Name&, Random&) -> api::Request { return api::Stop{{m, m}}; }},
      {"stop, and of nobody",
       [](const Name& m, const Name&, Random&) -> api::Request {
         return api::Stop{{m, "nobody"}};
       }},
      {"stop all", [](const Name&, const Name&, Random&) -> api::Request { return api::Stop{}; }},
      {"emergency stop", plain<api::EmergencyStop>},
      {"enable", plain<api::Enable>},
      {"disable", plain<api::Disable>},
      {"disable all",
       [](const Name&, const Name&, Random&) -> api::Request { return api::Disable{}; }},
      {"set",
       [](const Name& m, const Name&, Random& r) -> api::Request {
         return api::SetPosition{.motors = one(m, r), .dial = r() % 2 == 0};
       }},
      {"clear", plain<api::ClearFaults>},
      {"use table",
       [](const Name&, const Name&, Random& r) -> api::Request {
         return api::UseTable{.group = "axes",
                              .table = r() % 2 == 0 ? "bushd2-exponential" : "bushd2-constant"};
       }},
      {"reload tables", plain<api::ReloadTables>},
      {"home",
       [](const Name& m, const Name&, Random&) -> api::Request {
         return api::Home{.motors = {m}};
       }},
      {"home all",
       [](const Name&, const Name&, Random&) -> api::Request { return api::Home{.all = true}; }},
      {"arm",
       [](const Name& m, const Name&, Random& r) -> api::Request {
         return api::Arm{.delay_us = 100, .motors = one(m, r)};
       }},
      {"arm line",
       [](const Name& m, const Name& o, Random& r) -> api::Request {
         return api::ArmLine{.delay_us = 100, .motors = two(m, o, r)};
       }},
      {"disarm", plain<api::Disarm>},
      {"position compare",
       [](const Name& m, const Name&, Random& r) -> api::Request {
         return api::PositionCompare{
             .motor = m,
             .position = some_steps(r),
             .arrivals = {.positive = r() % 2 == 0, .negative = r() % 2 == 0},
             .width_us = 100};
       }},
      {"list tables", plain<api::ListTables>},
      {"get table",
       [](const Name&, const Name&, Random&) -> api::Request {
         return api::GetTable{"bushd2-constant"};
       }},
      {"set table",
       [](const Name&, const Name&, Random&) -> api::Request {
         return api::SetTable{.table = "another"};
       }},
      {"confirm", plain<api::Confirm>},
      {"history", plain<api::GetHistory>},
      {"show settings",
       [](const Name& m, const Name&, Random&) -> api::Request {
         return api::Configure{.motors = {m}};
       }},
      {"change settings",
       [](const Name& m, const Name&, Random&) -> api::Request {
         return api::Configure{.kind = api::Configure::Kind::kChange,
                               .changes = {{m, "soft_limits", "[-40000, 40000]"}}};
       }},
      {"jog",
       [](const Name& m, const Name&, Random& r) -> api::Request {
         return api::Jog{.motor = m,
                         .per_s = r() % 2 == 0 ? 400.0 : -150.0,
                         .in_steps = true,
                         .keepalive_ms = 400};
       }},
      {"end of a jog",
       [](const Name& m, const Name&, Random&) -> api::Request { return api::Jog{.motor = m}; }},
      {"end of a jog, later",
       [](const Name& m, const Name&, Random&) -> api::Request {
         return api::Jog{.motor = m, .steps_after = 60};
       }},
      {"renewal of a jog",
       [](const Name& m, const Name&, Random&) -> api::Request {
         return api::Jog{.motor = m, .renew = true};
       }},
      {"pause", plain<api::Pause>},
      {"pause all", [](const Name&, const Name&, Random&) -> api::Request { return api::Pause{}; }},
      {"resume", plain<api::Resume>},
      {"hold", plain<api::Hold>},
      {"release", plain<api::Release>},
      {"start of a program",
       [](const Name&, const Name&, Random&) -> api::Request {
         return api::Camac{.crate = 1, .block = {.cycles = {{5, 0, 26, 0}}}};
       }},
      {"clear of a module",
       [](const Name&, const Name&, Random&) -> api::Request {
         return api::Camac{.crate = 1, .block = {.cycles = {{7, 0, 24, 0}}}};
       }},
      {"put program",
       [](const Name& m, const Name&, Random& r) -> api::Request { return program(m, r); }},
      {"run programs",
       [](const Name& m, const Name&, Random&) -> api::Request { return api::RunPrograms{{m}}; }},
      {"list programs", plain<api::ListPrograms>},
      {"erase program",
       [](const Name& m, const Name&, Random&) -> api::Request { return api::EraseProgram{m}; }},
  };
  static const std::vector<Row> kRows = with_plain_rows(kWritten);
  return kRows;
}

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
          [](const api::ClearFaults&) { return Claims{}; },
          [](const api::Disarm&) { return Claims{}; },
          [](const api::Confirm& r) { return Claims{.places = named(r.motors)}; },
          // The rows above name a program as its motor.
          [](const api::RunPrograms& r) { return Claims{.moves = named(r.programs)}; },
          []<class Asked>(const Asked&) {
            static_assert(Asked::motion() == api::Motion::kNone, "say here what it asks for");
            return Claims{};
          },
      },
      request);
}

}  // namespace bushd::test::matrix

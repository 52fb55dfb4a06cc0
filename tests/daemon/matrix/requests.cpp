#include "daemon/matrix/requests.h"

#include "daemon/lab.h"

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

}  // namespace

const std::vector<Row>& requests() {
  static const std::vector<Row> kRows{
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
      {"stop", [](const Name& m, const Name&, Random&) -> api::Request { return api::Stop{{m}}; }},
      {"stop, named twice",
       [](const Name& m, const Name&, Random&) -> api::Request { return api::Stop{{m, m}}; }},
      {"stop, and of nobody",
       [](const Name& m, const Name&, Random&) -> api::Request {
         return api::Stop{{m, "nobody"}};
       }},
      {"stop all", [](const Name&, const Name&, Random&) -> api::Request { return api::Stop{}; }},
      {"emergency stop",
       [](const Name&, const Name&, Random&) -> api::Request { return api::EmergencyStop{}; }},
      {"enable",
       [](const Name& m, const Name&, Random&) -> api::Request { return api::Enable{{m}}; }},
      {"disable",
       [](const Name& m, const Name&, Random&) -> api::Request { return api::Disable{{m}}; }},
      {"disable all",
       [](const Name&, const Name&, Random&) -> api::Request { return api::Disable{}; }},
      {"set",
       [](const Name& m, const Name&, Random& r) -> api::Request {
         return api::SetPosition{.motors = one(m, r), .dial = r() % 2 == 0};
       }},
      {"clear",
       [](const Name& m, const Name&, Random&) -> api::Request { return api::ClearFaults{{m}}; }},
      {"use table",
       [](const Name&, const Name&, Random& r) -> api::Request {
         return api::UseTable{.group = "axes",
                              .table = r() % 2 == 0 ? "bushd2-exponential" : "bushd2-constant"};
       }},
      {"reload tables",
       [](const Name&, const Name&, Random&) -> api::Request { return api::ReloadTables{}; }},
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
      {"disarm",
       [](const Name& m, const Name&, Random&) -> api::Request { return api::Disarm{{m}}; }},
      {"position compare",
       [](const Name& m, const Name&, Random& r) -> api::Request {
         return api::PositionCompare{
             .motor = m,
             .position = some_steps(r),
             .arrivals = {.positive = r() % 2 == 0, .negative = r() % 2 == 0},
             .width_us = 100};
       }},
      {"list tables",
       [](const Name&, const Name&, Random&) -> api::Request { return api::ListTables{}; }},
      {"get table",
       [](const Name&, const Name&, Random&) -> api::Request {
         return api::GetTable{"bushd2-constant"};
       }},
      {"set table",
       [](const Name&, const Name&, Random&) -> api::Request {
         return api::SetTable{.table = "another"};
       }},
      {"confirm",
       [](const Name& m, const Name&, Random&) -> api::Request { return api::Confirm{{m}}; }},
      {"history",
       [](const Name& m, const Name&, Random&) -> api::Request {
         return api::GetHistory{.motor = m};
       }},
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
      {"pause",
       [](const Name& m, const Name&, Random&) -> api::Request { return api::Pause{{m}}; }},
      {"pause all", [](const Name&, const Name&, Random&) -> api::Request { return api::Pause{}; }},
      {"resume",
       [](const Name& m, const Name&, Random&) -> api::Request { return api::Resume{{m}}; }},
      {"hold", [](const Name& m, const Name&, Random&) -> api::Request { return api::Hold{{m}}; }},
      {"release",
       [](const Name& m, const Name&, Random&) -> api::Request { return api::Release{{m}}; }},
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
      {"list programs",
       [](const Name&, const Name&, Random&) -> api::Request { return api::ListPrograms{}; }},
      {"erase program",
       [](const Name& m, const Name&, Random&) -> api::Request { return api::EraseProgram{m}; }},
  };
  return kRows;
}

std::vector<int> rows_of_each_type() {
  std::vector<int> rows(std::variant_size_v<api::Request::variant>);
  Random random(1);
  for (const Row& row : requests()) ++rows[row.of("a", "b", random).index()];
  return rows;
}

}  // namespace bushd::test::matrix

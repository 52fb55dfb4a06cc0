#include "daemon/matrix/states.h"

#include "keypad_bytes.h"

namespace bushd::test::matrix {
namespace {

using Amounts = std::vector<api::MotorAmount>;

// Anywhere in ramps and cruise of a move of some thousand steps.
void run_somewhere(WatchedLab& lab) {
  lab.run(0.02 + lab.below(900) * 1e-3);
}
void move(WatchedLab& lab, Amounts amounts) {
  lab.ask(api::Move{.motors = std::move(amounts)});
}
api::Follow trajectory(api::Follow::Part part) {
  api::Follow asked{.part = part, .array = 3, .motors = {"c", "d"}};
  if (part == api::Follow::Part::kRun) return asked;
  asked.time_s = {0, 4, 8};
  asked.positions = {0, 0, 200, -90, 0, 0};
  return asked;
}
void load_program(WatchedLab& lab) {
  lab.cycle(5, 1, 16, 0);
  for (const std::uint32_t byte : {120U, 0U, 200U, 150U, 120U, 100U, 90U, 90U, 90U, 90U})
    lab.cycle(5, 0, 16, byte);
  lab.cycle(5, 2, 16, 0x60);
  lab.cycle(5, 0, 26);
}
void load_shutter(WatchedLab& lab) {
  lab.cycle(7, 1, 16, 0);
  std::vector<std::uint32_t> bytes{20, 0, 100, 0};
  for (int i = 0; i < 20; ++i) bytes.insert(bytes.end(), {244, 1});
  for (const std::uint32_t byte : bytes) lab.cycle(7, 0, 16, byte);
  // To the farther switch: at the other one it stands, or is barred until it has moved away.
  const std::uint32_t left = lab.steps_of("shutter") > kShutterWay / 2 ? 0x08 : 0;
  lab.cycle(7, 2, 16, 0x77 | left);
  lab.cycle(7, 0, 26);
}

// Its name is that of its motor, as in requests.cpp.
void run_program(WatchedLab& lab) {
  const auto put =
      lab.ask(api::PutProgram{.program = "c",
                              .text = "motors = [\"c\"]\nunit = \"steps\"\n[[frame]]\nrepeat = 3\n"
                                      "[[frame]]\nmove_by = [500]\n[[frame]]\nwait_s = 0.1\n"
                                      "[[frame]]\nmove_by = [-300]\n[[frame]]\nnext = true\n"});
  lab.run_till([&] { return lab.has_result(put); });
  lab.ask(api::RunPrograms{{"c"}});
  run_somewhere(lab);
}

}  // namespace

const std::vector<State>& states() {
  static const std::vector<State> kStates{
      {"rest", "c", false, "d", [](WatchedLab&) {}},
      {"rest with a home switch", "a", false, "d", [](WatchedLab&) {}},
      {"asked for just now", "c", false, "d", [](WatchedLab& lab) { move(lab, {{"c", 900}}); }},
      {"moving", "c", true, "d",
       [](WatchedLab& lab) {
         move(lab, {{"c", 2500}});
         run_somewhere(lab);
       }},
      {"moving with another", "c", true, "d",
       [](WatchedLab& lab) {
         move(lab, {{"c", 2500}, {"d", -700}});
         run_somewhere(lab);
       }},
      {"ramping down", "c", true, "d",
       [](WatchedLab& lab) {
         move(lab, {{"c", 2500}});
         run_somewhere(lab);
         lab.ask(api::Stop{{"c"}});
         lab.run(lab.below(200) * 1e-3);
       }},
      {"turning round", "c", true, "d",
       [](WatchedLab& lab) {
         move(lab, {{"c", 2500}});
         run_somewhere(lab);
         lab.ask(api::Move{.kind = api::Move::Kind::kAbsolute, .motors = {{"c", -400}}});
         lab.run(lab.below(400) * 1e-3);
       }},
      {"last approach", "b", true, "c",
       [](WatchedLab& lab) {
         move(lab, {{"b", -300}});
         lab.run(0.2 + lab.below(500) * 1e-3);
       }},
      {"settling", "b", true, "c",
       [](WatchedLab& lab) {
         move(lab, {{"b", 10}});
         lab.run(0.15 + lab.below(250) * 1e-3);
       }},
      {"on a line", "c", true, "d",
       [](WatchedLab& lab) {
         lab.ask(api::MoveLine{.motors = {{"c", 2000}, {"d", 700}}});
         run_somewhere(lab);
       }},
      {"on a line, settling", "b", true, "d",
       [](WatchedLab& lab) {
         lab.ask(api::MoveLine{.motors = {{"b", 30}, {"d", 10}}});
         lab.run(0.3 + lab.below(300) * 1e-3);
       }},
      {"path being planned", "c", false, "d",
       [](WatchedLab& lab) {
         api::MovePath path{.motors = {"c", "d"}, .rows = 1500};
         for (int row = 0; row < path.rows; ++row) {
           path.positions.push_back(row % 7);
           path.positions.push_back(row);
         }
         lab.ask(path);
       }},
      {"path in parts", "c", false, "d",
       [](WatchedLab& lab) {
         lab.ask(api::MovePath{.motors = {"c", "d"}, .rows = 6, .positions = {10, 20, 30, 10}},
                 "other");
       }},
      {"on a path", "c", true, "d",
       [](WatchedLab& lab) {
         lab.ask(api::MovePath{
             .motors = {"c", "d"}, .rows = 3, .positions = {400, 100, 900, 300, 1500, -200}});
         run_somewhere(lab);
       }},
      {"trajectory loaded", "c", false, "d",
       [](WatchedLab& lab) { lab.ask(trajectory(api::Follow::Part::kLastRows)); }},
      {"following", "c", true, "d",
       [](WatchedLab& lab) {
         const auto loaded = lab.ask(trajectory(api::Follow::Part::kLastRows));
         lab.run_till([&] { return lab.has_result(loaded); });
         lab.ask(trajectory(api::Follow::Part::kRun));
         lab.run(lab.below(2500) * 1e-3);
       }},
      {"jogging", "c", true, "d",
       [](WatchedLab& lab) {
         lab.ask(api::Jog{.motor = "c", .per_s = 300, .in_steps = true, .keepalive_ms = 2000});
         lab.run(lab.below(900) * 1e-3);
       }},
      {"jog that ends", "c", true, "d",
       [](WatchedLab& lab) {
         lab.ask(api::Jog{.motor = "c", .per_s = 900, .in_steps = true, .keepalive_ms = 2000});
         run_somewhere(lab);
         lab.ask(api::Jog{.motor = "c"});
         lab.run(lab.below(120) * 1e-3);
       }},
      {"jog of another client", "c", true, "d",
       [](WatchedLab& lab) {
         lab.ask(api::Jog{.motor = "c", .per_s = -300, .in_steps = true, .keepalive_ms = 2000},
                 "other");
         run_somewhere(lab);
       }},
      {"homing", "a", true, "d",
       [](WatchedLab& lab) {
         lab.ask(api::Home{.motors = {"a"}});
         lab.run(lab.below(2500) * 1e-3);
       }},
      {"homing all", "e", true, "a",
       [](WatchedLab& lab) {
         lab.ask(api::Home{.all = true});
         lab.run(lab.below(2500) * 1e-3);
       }},
      {"pausing", "c", true, "d",
       [](WatchedLab& lab) {
         move(lab, {{"c", 2500}});
         run_somewhere(lab);
         lab.ask(api::Pause{{"c"}});
         lab.run(lab.below(150) * 1e-3);
       }},
      {"paused", "c", true, "d",
       [](WatchedLab& lab) {
         move(lab, {{"c", 2500}});
         run_somewhere(lab);
         lab.ask(api::Pause{{"c"}});
         lab.run(0.5);
       }},
      {"paused on a line", "c", true, "d",
       [](WatchedLab& lab) {
         lab.ask(api::MoveLine{.motors = {{"c", 2000}, {"d", 700}}});
         run_somewhere(lab);
         lab.ask(api::Pause{{"c"}});
         lab.run(lab.below(600) * 1e-3);
       }},
      {"held", "c", false, "d", [](WatchedLab& lab) { lab.ask(api::Hold{{"c"}}); }},
      {"held in motion", "c", true, "d",
       [](WatchedLab& lab) {
         move(lab, {{"c", 1500}});
         run_somewhere(lab);
         lab.ask(api::Hold{{"c"}});
       }},
      {"arming", "c", false, "d",
       [](WatchedLab& lab) { lab.ask(api::Arm{.delay_us = 100, .motors = {{"c", 400}}}); }},
      {"armed", "c", false, "d",
       [](WatchedLab& lab) {
         lab.ask(api::Arm{.delay_us = 100, .motors = {{"c", 400}, {"d", -90}}});
         lab.run(0.3 + lab.below(300) * 1e-3);
       }},
      {"armed on a line", "c", false, "b",
       [](WatchedLab& lab) {
         lab.ask(api::ArmLine{.delay_us = 100, .motors = {{"c", 400}, {"b", 90}}});
         lab.run(lab.below(800) * 1e-3);
       }},
      {"triggered", "c", true, "d",
       [](WatchedLab& lab) {
         lab.ask(api::Arm{.delay_us = 100, .motors = {{"c", 1400}}});
         lab.run(0.4);
         lab.press(BUSHD_INPUT_TRIGGER);
         lab.run(lab.below(700) * 1e-3);
       }},
      {"moved by an input", "a", true, "d",
       [](WatchedLab& lab) {
         lab.press(BUSHD_INPUT_FORWARD);
         run_somewhere(lab);
       }},
      {"moved by an input, released", "a", true, "d",
       [](WatchedLab& lab) {
         lab.press(BUSHD_INPUT_REVERSE);
         lab.run(0.3 + lab.below(300) * 1e-3);
         lab.press(0);
         lab.run(lab.below(150) * 1e-3);
       }},
      {"paused and pressed", "a", true, "d",
       [](WatchedLab& lab) {
         move(lab, {{"a", 2500}});
         run_somewhere(lab);
         lab.ask(api::Pause{{"a"}});
         lab.run(0.5);
         lab.press(BUSHD_INPUT_FORWARD);
         lab.run(lab.below(400) * 1e-3);
       }},
      {"held and pressed", "a", false, "d",
       [](WatchedLab& lab) {
         lab.ask(api::Hold{{"a"}});
         lab.run(lab.below(100) * 1e-3);
         lab.press(BUSHD_INPUT_FORWARD);
         lab.run(lab.below(400) * 1e-3);
       }},
      {"armed and pressed", "a", false, "d",
       [](WatchedLab& lab) {
         lab.ask(api::Arm{.delay_us = 100, .motors = {{"a", 400}}});
         lab.run(0.3);
         lab.press(BUSHD_INPUT_FORWARD | BUSHD_INPUT_TRIGGER);
         lab.run(lab.below(400) * 1e-3);
       }},
      {"moved by a keypad", "c", true, "d",
       [](WatchedLab& lab) {
         lab.key(kKeyForward);
         lab.run(lab.below(600) * 1e-3);
       }},
      {"at a limit", "a", false, "d",
       [](WatchedLab& lab) {
         lab.hold_input(8, true);
         lab.run(0.1);
       }},
      {"meets a limit", "a", true, "d",
       [](WatchedLab& lab) {
         const std::int64_t from = lab.steps_of("a");
         // Where it has met one before it is barred until it has moved away.
         move(lab, {{"a", -60}});
         lab.run_till([&] { return lab.steps_of("a") == from - 60 && lab.stands("a"); });
         move(lab, {{"a", 2500}});
         lab.run(0.4 + lab.below(500) * 1e-3);
         lab.hold_input(8, true);
         lab.run(lab.below(150) * 1e-3);
       }},
      {"offline", "c", true, "d",
       [](WatchedLab& lab) {
         move(lab, {{"c", 2500}});
         run_somewhere(lab);
         lab.cut_line();
         lab.run(lab.below(2500) * 1e-3);
       }},
      {"coming", "c", false, "d",
       [](WatchedLab& lab) {
         lab.reset_mcu(0);
         lab.run(lab.below(900) * 1e-3);
       }},
      {"reset in motion", "c", true, "d",
       [](WatchedLab& lab) {
         move(lab, {{"c", 2500}, {"d", 1500}});
         run_somewhere(lab);
         lab.reset_mcu(0);
         lab.run(lab.below(1500) * 1e-3);
       }},
      {"uncertain", "c", false, "d",
       [](WatchedLab& lab) {
         lab.reset_mcu(0);
         lab.run_till([&] { return !lab.all_ready(); }, 3);
         lab.run_till([&] { return lab.all_ready(); });
       }},
      {"asleep", "d", false, "c", [](WatchedLab& lab) { lab.run(0.9); }},
      {"waking", "d", false, "c",
       [](WatchedLab& lab) {
         lab.run(0.9);
         move(lab, {{"d", 600}});
         lab.run(lab.below(150) * 1e-3);
       }},
      {"waits for the disk", "c", false, "d",
       [](WatchedLab& lab) {
         lab.disk_us = 300'000;
         move(lab, {{"c", 600}});
         lab.run(lab.below(280) * 1e-3);
       }},
      {"table being uploaded", "c", false, "d",
       [](WatchedLab& lab) {
         lab.ask(api::UseTable{.group = "axes", .table = "bushd2-scurve"});
         lab.run(lab.below(60) * 1e-3);
       }},
      {"disabled", "c", false, "d",
       [](WatchedLab& lab) {
         lab.ask(api::Disable{{"c"}});
         lab.run(lab.below(300) * 1e-3);
       }},
      {"emergency stop under way", "c", true, "d",
       [](WatchedLab& lab) {
         move(lab, {{"c", 2500}, {"d", 2500}});
         run_somewhere(lab);
         lab.ask(api::EmergencyStop{});
         lab.run(lab.below(150) * 1e-3);
       }},
      {"emergency stop latched", "c", false, "d",
       [](WatchedLab& lab) {
         lab.ask(api::EmergencyStop{});
         lab.run(0.6);
       }},
      {"emergency input", "c", true, "d",
       [](WatchedLab& lab) {
         move(lab, {{"c", 2500}, {"d", 700}});
         run_somewhere(lab);
         lab.press(BUSHD_INPUT_EMERGENCY);
         lab.run(lab.below(500) * 1e-3);
       }},
      {"in a program of its MCU", "c", true, "d", run_program},
      {"paused in a program of its MCU", "c", true, "d",
       [](WatchedLab& lab) {
         run_program(lab);
         lab.ask(api::Pause{{"c"}});
         lab.run(lab.below(500) * 1e-3);
       }},
      {"offline in a program of its MCU", "c", true, "d",
       [](WatchedLab& lab) {
         run_program(lab);
         lab.cut_line();
         lab.run(lab.below(2500) * 1e-3);
       }},
      {"program", "program", true, "c",
       [](WatchedLab& lab) {
         load_program(lab);
         lab.run(lab.below(700) * 1e-3);
       }},
      {"shutter", "shutter", true, "c",
       [](WatchedLab& lab) {
         load_shutter(lab);
         lab.run(lab.below(1500) * 1e-3);
       }},
      {"daemon is lost", "c", true, "d",
       [](WatchedLab& lab) {
         move(lab, {{"c", 2500}, {"d", 700}});
         run_somewhere(lab);
         lab.lose_daemon();
         lab.run(lab.below(1500) * 1e-3);
       }},
      {"daemon ends", "c", true, "d",
       [](WatchedLab& lab) {
         move(lab, {{"c", 2500}, {"d", 700}});
         run_somewhere(lab);
         lab.end_daemon();
         lab.run(lab.below(150) * 1e-3);
       }},
  };
  return kStates;
}

}  // namespace bushd::test::matrix

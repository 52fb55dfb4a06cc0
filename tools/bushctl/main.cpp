// bushctl: the command line client of bushd.
#include <fmt/format.h>

#include <cstdio>
#include <exception>

#include "base/standard_output.h"
#include "commands.h"

int main(int argc, char** argv) {
  bushd::expect_closed_output();
  try {
    bushctl::CommandLine commands(BUSHD_VERSION);
    bushctl::add_view_commands(commands);
    bushctl::add_motion_commands(commands);
    bushctl::add_path_commands(commands);
    bushctl::add_follow_command(commands);
    bushctl::add_jog_commands(commands);
    bushctl::add_plain_commands(commands);
    bushctl::add_history_commands(commands);
    bushctl::add_config_commands(commands);
    bushctl::add_table_commands(commands);
    bushctl::add_program_commands(commands);
    bushctl::add_camac_commands(commands);
    bushctl::add_raw_bus_commands(commands);
    bushctl::add_setup_command(commands);
    bushctl::add_doctor_command(commands);
    bushctl::add_web_commands(commands);
    if (const auto words = bushd::completion_asked(argc, argv)) {
      return bushd::finished_output(bushctl::complete(commands, *words));
    }
    return bushd::finished_output(commands.run(argc, argv));
  } catch (const std::exception& error) {
    fmt::print(stderr, "bushctl: {}\n", error.what());
    return bushctl::kFailed;
  }
}

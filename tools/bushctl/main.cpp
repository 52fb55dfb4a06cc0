// bushctl: the command line client of bushd.
#include <fmt/format.h>

#include <cstdio>
#include <exception>

#include "base/standard_output.h"
#include "commands.h"

int main(int argc, char** argv) {
  bushd::expect_closed_output();
  try {
    bushctl::CommandLine line(BUSHD_VERSION);
    bushctl::add_view_commands(line);
    bushctl::add_motion_commands(line);
    bushctl::add_path_commands(line);
    bushctl::add_follow_command(line);
    bushctl::add_jog_commands(line);
    bushctl::add_pause_commands(line);
    bushctl::add_driver_commands(line);
    bushctl::add_history_commands(line);
    bushctl::add_config_commands(line);
    bushctl::add_table_commands(line);
    bushctl::add_camac_commands(line);
    bushctl::add_line_commands(line);
    bushctl::add_setup_command(line);
    bushctl::add_doctor_command(line);
    if (const auto words = bushd::completion_asked(argc, argv)) {
      return bushd::finished_output(bushctl::complete(line, *words));
    }
    return bushd::finished_output(line.run(argc, argv));
  } catch (const std::exception& error) {
    fmt::print(stderr, "bushctl: {}\n", error.what());
    return bushctl::kFailed;
  }
}

// The motors that the shipped tables are for: tables/motors/loads.csv.
#pragma once

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "sim/rotor.h"
#include "source_path.h"
#include "tables/profiles/motor.h"
#include "tables/table_file.h"

namespace bushd::test {

inline const std::filesystem::path kShippedTables = source_path("tables");

inline std::vector<std::string> shipped_tables() {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(kShippedTables)) {
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem());
  }
  std::sort(names.begin(), names.end());
  return names;
}

inline tables::profiles::Motor shipped_motor(const std::string& table) {
  std::ifstream file(kShippedTables / "motors/loads.csv");
  for (std::string line; std::getline(file, line);) {
    std::istringstream row(line);
    std::vector<std::string> cells;
    for (std::string cell; std::getline(row, cell, ',');) cells.push_back(cell);
    if (cells.size() != 7 || cells[0] != table) continue;
    tables::profiles::Motor motor{.inertia_kgm2 = std::stod(cells[2]) * 1e-7,
                                  .friction_nm = std::stod(cells[3]) * 1e-2,
                                  .brake_friction_nm = std::stod(cells[4]) * 1e-2,
                                  .steps_per_turn = std::stod(cells[5]),
                                  .full_steps_per_turn = std::stod(cells[6])};
    motor.torque = tables::profiles::load_torque_csv(
                       kShippedTables / "motors" / (cells[1] + ".csv"), motor.steps_per_turn)
                       .value();
    return motor;
  }
  throw std::runtime_error("tables/motors/loads.csv has no motor for " + table);
}

inline sim::RotorRules rotor_rules(const tables::profiles::Motor& motor, double friction_nm,
                                   double damping_ratio) {
  sim::RotorRules rules{.inertia_kgm2 = motor.inertia_kgm2,
                        .friction_nm = friction_nm,
                        .damping_ratio = damping_ratio,
                        .steps_per_turn = motor.steps_per_turn,
                        .full_steps_per_turn = motor.full_steps_per_turn};
  for (const auto& point : motor.torque)
    rules.pull_out.push_back({point.speed_hz, point.torque_nm});
  return rules;
}

}  // namespace bushd::test

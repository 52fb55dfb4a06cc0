// A lab with the motors m0 and m5 behind a commutator board, of either clock.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "daemon/lab.h"
#include "tables/table_file.h"

namespace bushd::test {

// `clock`: the key of the bus that says what a code is, "start_hz = 100".
inline std::string with_motors_of_board(int baud, const std::string& clock,
                                        const std::string& bus_keys = "",
                                        const std::string& m0_keys = "") {
  return "[[bus]]\nname = \"board\"\nkind = \"commutator\"\nport = \"/dev/null\"\nbaud = " +
         std::to_string(baud) + "\n" + clock + "\n" + bus_keys +
         "[[group]]\nname = \"axes\"\ntable = \"bushd2-constant\"\n"
         "[[motor]]\nname = \"m0\"\nmcu = \"board\"\noutput = 0\ngroup = \"axes\"\n" +
         m0_keys + "[[motor]]\nname = \"m5\"\nmcu = \"board\"\noutput = 5\ngroup = \"axes\"\n";
}

class BoardLab : public Lab {
 public:
  // `board` is that of the lab unless it is null.
  explicit BoardLab(const std::string& toml, std::unique_ptr<sim::BoardEnd> board = nullptr)
      : Lab(toml) {
    if (board) replace_board(0, std::move(board));
    connect();
    on_send = [this](std::size_t, std::vector<std::uint8_t>& bytes) {
      sent.insert(sent.end(), bytes.begin(), bytes.end());
      return true;
    };
  }
  Answer move(const std::string& motor, std::int64_t steps) {
    return wait(send(Ask::kMoveBy, {motor}, {steps}), 120);
  }
  // Without an end, m0.
  std::int64_t jog(double per_s) {
    return send(api::Jog{.motor = "m0", .per_s = per_s, .in_steps = true, .keepalive_ms = 10'000});
  }
  bool trusted(const std::string& name) const { return motor(name).trust == api::Trust::kKnown; }
  void moves(std::int64_t steps) {
    ASSERT_TRUE(run_until([&] { return std::abs(shaft_steps("m0")) >= steps; }));
  }

  std::vector<std::uint8_t> sent;  // since all were ready
};

// The delays 250, 249, ..., 10 of the table "bushd2-constant".
inline std::vector<std::int64_t> delay_codes() {
  const auto loaded = tables::load(*tables::find("bushd2-constant", tables::shipped_directories()));
  const bushd_ramp& accel = (*loaded)->view().accel;
  return {accel.code, accel.code + accel.count};
}

// Delays of 40 us: K is 2500 / 2500 Hz x 10^8 ns / delay, rounded down.
inline std::vector<std::int64_t> converter_codes() {
  std::vector<std::int64_t> codes = delay_codes();
  for (std::int64_t& code : codes) code = 2500 / code;
  return codes;
}

// Step k of a move of n steps from rest to rest; D3 of the report's digest.
inline std::int64_t code_of_step(const std::vector<std::int64_t>& codes, std::size_t k,
                                 std::size_t n) {
  return codes[std::min({k, n - 1 - k, codes.size() - 1})];
}

}  // namespace bushd::test

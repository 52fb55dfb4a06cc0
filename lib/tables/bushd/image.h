// Memory images of the CAMAC blocks of 1985 (JINR P10-85-635), whose idea tables are.
//
// BUSHD-2: 1024 bytes, four pages of 256. In a page: [0,1] number of steps, low byte first;
// [2..239] 238 delay codes, slow to fast, run up and down again; [240..255] free for motor
// positions. Code 250 is F_start, set by hardware to 1..100 Hz, code 10 is 25 F_start.
//
// BUSHD-1: [0] number of steps, up to 126; [2,3] delay from reactor start, low byte first; then
// one delay code for each step of the travel, out and back alike.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "base/result.h"
#include "tables/table.h"

namespace bushd::tables::image {

inline constexpr std::size_t kPages = 4;
inline constexpr std::size_t kPageBytes = 256;
inline constexpr std::size_t kCodes = 238;
inline constexpr std::size_t kPositionBytes = 16;
inline constexpr std::uint32_t kMaxSteps = 65535;
inline constexpr std::uint32_t kBushd1MaxSteps = 126;

using Page = std::array<std::uint8_t, kPageBytes>;
using Image = std::array<Page, kPages>;

// A motion program as a page holds it.
struct Program {
  std::uint32_t steps = 0;
  std::vector<std::uint8_t> codes{};  // kCodes of them
  std::array<std::uint8_t, kPositionBytes> positions{};
};

Program read_page(const Page& page);
Page write_page(const Program& program);

// The codes of a table whose motion BUSHD-2 can do exactly; refused with the reason otherwise. A
// shorter table is filled up with its last code, which changes no motion.
Result<std::vector<std::uint8_t>> codes_of(const TableContent& content);
// F_start of that table, in Hz. Refused: outside of 1..100 Hz.
Result<double> start_hz_of(const TableContent& content);

// The table of a page: what repeats its last code is left out. Codes outside of 10..250, rising
// ones and a start outside of 1..100 Hz are refused.
Result<TableContent> table_of(const std::vector<std::uint8_t>& codes, double start_hz);

// The nearest table that BUSHD-2 can do: never faster, the same acceleration, the top speed cut
// where codes end. `report` tells what was lost.
struct Resampled {
  TableContent content;
  double worst_speed_error = 0;  // the greatest share by which a step is slower than asked
  double top_hz_before = 0;
  double top_hz_after = 0;
};
Result<Resampled> resample(const TableContent& content);

// BUSHD-1: a travel of `steps` with the table, as a memory of 4 + steps bytes, and back: a table
// with which a move of as many steps has just these delays.
struct Travel {
  std::uint32_t reactor_delay = 0;  // code, 16 bits
  std::vector<std::uint8_t> codes{};
};
Result<Travel> travel_of(const TableContent& content, std::uint32_t steps,
                         std::uint32_t reactor_delay);
std::vector<std::uint8_t> write_travel(const Travel& travel);
Result<Travel> read_travel(const std::vector<std::uint8_t>& bytes);
Result<TableContent> table_of(const Travel& travel, std::uint32_t time_unit_ns);

}  // namespace bushd::tables::image

// Cycles of a CAMAC crate and blocks of them, as values: what is asked, and what is answered.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "base/fields.h"

namespace bushd::camac {

inline constexpr int kStations = 23;  // for modules, 1 .. 23
inline constexpr int kLastSubaddress = 15;
inline constexpr int kLastFunction = 31;
inline constexpr std::uint32_t kDataMask = 0xFFFFFF;
// What can be asked for. N24 and above are of the crate's controller.
inline constexpr bushd::fields::Range<std::int64_t> kStation{1, 31};
inline constexpr bushd::fields::Range<std::int64_t> kModules{1, kStations};
inline constexpr bushd::fields::Range<std::int64_t> kSubaddress{0, kLastSubaddress};
inline constexpr bushd::fields::Range<std::int64_t> kFunction{0, kLastFunction};
inline constexpr bushd::fields::Range<std::int64_t> kData{0, kDataMask};

// The others carry no data.
constexpr bool reads(int function) {
  return function >= 0 && function < 8;
}
constexpr bool writes(int function) {
  return function >= 16 && function < 24;
}

struct Naf {
  int station = 0;
  int subaddress = 0;
  int function = 0;
  std::uint32_t data = 0;

  static constexpr std::string_view kName = "camac cycle";
  static constexpr std::string_view kMeaning = "A cycle of a CAMAC crate.";
  static void fields(auto& self, auto& visit) {
    constexpr bushd::fields::As<std::int8_t> kByte{};
    visit({"station", "N", kStation}, self.station, kByte);
    visit({"subaddress", "A", kSubaddress}, self.subaddress, kByte);
    visit({"function", "F", kFunction}, self.function, kByte);
    visit({"data", "W; of functions that write", kData}, self.data);
  }
  friend bool operator==(const Naf&, const Naf&) = default;
};

struct Response {
  bool x = false;
  bool q = false;
  std::uint32_t data = 0;

  static constexpr std::string_view kName = "camac response";
  static constexpr std::string_view kMeaning =
      "What a station of a CAMAC crate has answered to a cycle.";
  static void fields(auto& self, auto& visit) {
    visit({"x", "the station has this command"}, self.x);
    visit("q", self.q);
    visit({"data", "R; 0 of functions that do not read", kData}, self.data);
  }
  friend bool operator==(const Response&, const Response&) = default;
};

enum class BlockMode {
  kSingle,
  kRepeat,  // at most Block::kMostTries times
  kQStop,
  kScan
};

struct Block {
  static constexpr int kMostTries = 100;
  static constexpr std::uint32_t kMostCycles = 4096;  // also of words
  static constexpr bushd::fields::Range<std::int64_t> kWords{1, kMostCycles};
  static constexpr bushd::fields::OneOf kMode{
      {{"SINGLE", "each cycle of the list, whatever X and Q"},
       {"REPEAT", "address of the first, each word tried again until Q"},
       {"Q_STOP", "address of the first, until Q = 0"},
       {"SCAN",
        "from the first address on: next subaddress after Q = 1, next station after Q = 0"}}};

  BlockMode mode = BlockMode::kSingle;
  std::vector<Naf> cycles{};
  std::uint32_t count = 1;
  int last_station = kStations;
  int last_subaddress = kLastSubaddress;
  static void fields(auto& self, auto& visit) {
    visit("mode", self.mode, kMode);
    visit({"count", "words; of SINGLE and of functions that write: cycle_count", kWords},
          self.count);
    visit({"last_station", "of SCAN, inclusive", kModules}, self.last_station);
    visit({"last_subaddress", "of SCAN", kSubaddress}, self.last_subaddress);
    visit.list({"cycle_count", "", kWords},
               {"cycles",
                "the first one of a block other than SINGLE has the address, and each a word, if "
                "it writes"},
               self.cycles);
  }
  friend bool operator==(const Block&, const Block&) = default;
};

struct BlockResult {
  // Responses of the cycles that moved a word, and of all cycles of kSingle; a block at one address
  // has that too by which it ended.
  std::vector<Response> responses{};
  std::uint32_t tally = 0;
  friend bool operator==(const BlockResult&, const BlockResult&) = default;
};

}  // namespace bushd::camac

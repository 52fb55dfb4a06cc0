// Cycles of a CAMAC crate and blocks of them, as values: what is asked, and what is answered.
#pragma once

#include <cstdint>
#include <vector>

#include "base/fields.h"

namespace bushd::camac {

inline constexpr int kStations = 23;  // for modules, 1 .. 23
inline constexpr int kLastSubaddress = 15;
inline constexpr int kLastFunction = 31;
inline constexpr std::uint32_t kDataMask = 0xFFFFFF;

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
  std::uint32_t data = 0;  // W; of functions that write
  static void fields(auto& self, auto& visit) {
    constexpr bushd::fields::As<std::int8_t> kByte{};
    visit("station", self.station, kByte);
    visit("subaddress", self.subaddress, kByte);
    visit("function", self.function, kByte);
    visit("data", self.data);
  }
  friend bool operator==(const Naf&, const Naf&) = default;
};

struct Response {
  bool x = false;
  bool q = false;
  std::uint32_t data = 0;  // R; 0 of functions that do not read
  static void fields(auto& self, auto& visit) {
    visit("x", self.x);
    visit("q", self.q);
    visit("data", self.data);
  }
  friend bool operator==(const Response&, const Response&) = default;
};

enum class BlockMode {
  kSingle,  // each cycle of a list, whatever X and Q
  kRepeat,  // one address; the same word again until Q, or kMostTries times
  kQStop,   // one address, until a word without Q, which is none
  kScan     // one subaddress after the other, after one without Q the next station
};

struct Block {
  static constexpr int kMostTries = 100;

  BlockMode mode = BlockMode::kSingle;
  // The first cycle of a block other than kSingle has the address, and each one a word, if it
  // writes.
  std::vector<Naf> cycles{};  // at least one
  // Words; of kSingle and of blocks that write as many as there are cycles.
  std::uint32_t count = 1;
  // The last address of a kScan, inclusive.
  int last_station = kStations;
  int last_subaddress = kLastSubaddress;
  static void fields(auto& self, auto& visit) {
    visit("mode", self.mode, bushd::fields::OneOf<4>{});
    visit("count", self.count);
    visit("last_station", self.last_station);
    visit("last_subaddress", self.last_subaddress);
    visit.list("cycle_count", "cycles", self.cycles);
  }
  friend bool operator==(const Block&, const Block&) = default;
};

struct BlockResult {
  // Responses of the cycles that moved a word, and of all cycles of kSingle; a block at one address
  // has that too by which it ended.
  std::vector<Response> responses{};
  std::uint32_t tally = 0;  // words moved; of kSingle cycles made
  friend bool operator==(const BlockResult&, const BlockResult&) = default;
};

}  // namespace bushd::camac

// Block transfers: many cycles of a crate as one, of one register or of a row of them, for as long
// as Q says that there is more.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "camac/crate.h"

namespace bushd::camac {

struct Naf {
  int station = 0;
  int subaddress = 0;
  int function = 0;
  std::uint32_t data = 0;  // W; of functions that write
  friend bool operator==(const Naf&, const Naf&) = default;
};

enum class BlockMode {
  kSingle,  // each cycle of a list, whatever X and Q
  kRepeat,  // one address; the same word again until Q, or kMostTries times
  kQStop,   // one address, until a word without Q, which is none
  kScan     // one subaddress after the other, after one without Q the next station
};

// single, repeat, q-stop, scan
std::string_view word(BlockMode mode);

struct Block {
  static constexpr int kMostTries = 100;

  BlockMode mode = BlockMode::kSingle;
  // Of a block other than kSingle the first one has the address, and each one a word, if it writes.
  std::vector<Naf> cycles{};  // at least one
  // Words; of kSingle and of blocks that write as many as there are cycles.
  std::uint32_t count = 1;
  // Of kScan: the last address, inclusive.
  int last_station = Crate::kStations;
  int last_subaddress = 15;
};

struct BlockResult {
  // Of the cycles that moved a word, of kSingle of all; of one address that by which it ended, too.
  std::vector<Response> responses{};
  std::uint32_t tally = 0;  // words moved; of kSingle cycles made
};

// An answer X = 0 ends all but kSingle and kScan, which has to pass empty stations.
BlockResult transfer(std::int64_t now_us, Crate& crate, const Block& block);

}  // namespace bushd::camac

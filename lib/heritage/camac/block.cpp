#include "heritage/camac/block.h"

#include <tuple>

namespace bushd::camac {
namespace {

Response make(Crate& crate, const Naf& naf) {
  return crate.cycle(naf.station,
                     {.subaddress = naf.subaddress, .function = naf.function, .data = naf.data});
}

// The data of the next word. Of blocks that read there are none.
std::uint32_t word_of(const Block& block, std::uint32_t index) {
  return index < block.cycles.size() ? block.cycles[index].data : 0;
}

BlockResult each(Crate& crate, const Block& block) {
  BlockResult result;
  for (const Naf& naf : block.cycles) result.responses.push_back(make(crate, naf));
  result.tally = static_cast<std::uint32_t>(block.cycles.size());
  return result;
}

// The first cycle with Q, or the last one that was tried.
Response until_q(Crate& crate, const Naf& naf, int most_tries) {
  Response response = make(crate, naf);
  for (int tries = 1; tries < most_tries && response.x && !response.q; ++tries) {
    response = make(crate, naf);
  }
  return response;
}

BlockResult one_address(Crate& crate, const Block& block) {
  BlockResult result;
  Naf naf = block.cycles.front();
  const int tries = block.mode == BlockMode::kRepeat ? Block::kMostTries : 1;
  while (result.tally < block.count) {
    naf.data = word_of(block, result.tally);
    result.responses.push_back(until_q(crate, naf, tries));
    if (!result.responses.back().x || !result.responses.back().q) break;
    ++result.tally;
  }
  return result;
}

BlockResult scan(Crate& crate, const Block& block) {
  BlockResult result;
  Naf naf = block.cycles.front();
  const std::tuple last{block.last_station, block.last_subaddress};
  while (result.tally < block.count && naf.station <= kStations &&
         std::tuple{naf.station, naf.subaddress} <= last) {
    naf.data = word_of(block, result.tally);
    const Response response = make(crate, naf);
    if (response.q) {
      result.responses.push_back(response);
      ++result.tally;
    }
    if (response.q && naf.subaddress < kLastSubaddress) {
      ++naf.subaddress;
    } else {
      ++naf.station;
      naf.subaddress = 0;
    }
  }
  return result;
}

}  // namespace

BlockResult transfer(Crate& crate, const Block& block) {
  switch (block.mode) {
    case BlockMode::kSingle:
      return each(crate, block);
    case BlockMode::kScan:
      return scan(crate, block);
    default:
      return one_address(crate, block);
  }
}

}  // namespace bushd::camac

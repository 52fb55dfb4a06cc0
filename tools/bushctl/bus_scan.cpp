#include "bus_scan.h"

#include <algorithm>
#include <array>
#include <cstring>

namespace bushctl {
namespace {

using bushd::fail;
using bushd::Result;
using std::chrono::microseconds;

// An answer may begin so late after the beginning of its window, and the bus must be let go.
constexpr microseconds kWindowGuard{600};
constexpr std::uint8_t kScanWindows = 64;
// With every further round the chance that two MCUs have hidden each other in all of them falls:
// looked for until three rounds in a row have found nothing new.
constexpr unsigned kMaxRounds = 16;
constexpr unsigned kQuietRounds = 3;

bool never(const RawBus::Answers&) {
  return false;
}

Result<std::vector<Found>> identify(RawBus& bus, std::uint8_t address, std::uint16_t salt,
                                    std::uint8_t windows) {
  const microseconds window =
      bus.bus_time(BUSHD_IDENTITY_SIZE + BUSHD_FRAME_OVERHEAD + 1) + kWindowGuard;
  const bushd_identify message = {
      .salt = salt,
      .windows = windows,
      .window_units = static_cast<std::uint16_t>(
          std::min<std::int64_t>(window.count() * 1000 / BUSHD_REPLY_UNIT_NS + 1, UINT16_MAX))};
  std::array<std::uint8_t, 16> payload{};
  const std::size_t size = bushd_encode_identify(&message, payload.data());
  const auto answers = bus.ask(address, BUSHD_MSG_IDENTIFY, {payload.data(), size},
                               BUSHD_IDENTITY_SIZE, window * windows + kAnswerPatience, never);
  if (!answers) return fail(answers.error());
  std::vector<Found> found;
  for (const RawBus::Answer& answer : *answers) {
    Found mcu{.address = answer.address};
    if (bushd_decode_identity(answer.payload.data(), answer.payload.size(), &mcu.identity) ==
        BUSHD_OK) {
      found.push_back(mcu);
    }
  }
  return found;
}

bool same(const Found& a, const Found& b) {
  return a.address == b.address &&
         std::memcmp(a.identity.unique_id, b.identity.unique_id, BUSHD_UNIQUE_ID_SIZE) == 0;
}

}  // namespace

Result<std::vector<Found>> find_all(RawBus& bus) {
  std::vector<Found> all;
  unsigned quiet = 0;
  for (unsigned round = 1; round <= kMaxRounds && quiet < kQuietRounds; ++round) {
    const auto heard = identify(bus, BUSHD_ADDRESS_BROADCAST,
                                static_cast<std::uint16_t>(round * 257), kScanWindows);
    if (!heard) return fail(heard.error());
    ++quiet;
    for (const Found& mcu : *heard) {
      if (std::any_of(all.begin(), all.end(), [&](const Found& f) { return same(f, mcu); }))
        continue;
      all.push_back(mcu);
      quiet = 0;
    }
  }
  return all;
}

}  // namespace bushctl

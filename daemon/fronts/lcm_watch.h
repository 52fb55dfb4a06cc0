// What is wrong on LCM: it takes no messages, or another daemon uses the same channels, which may
// have come from elsewhere while this one was running. Said once when it begins and once when it is
// over, not with every message.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "daemon/fronts/lcm_front.h"
#include "daemon/fronts/publishing.h"
#include "daemon/model/outputs.h"

namespace bushd::daemon {

class LcmWatch {
 public:
  // A daemon describes itself every three seconds.
  static constexpr std::int64_t kGoneAfterUs = 10'000'000;

  using Log = std::function<void(LogLevel, const std::string&)>;
  // `front` and `publishing`, whose clients are told too, outlive it.
  LcmWatch(const LcmFront& front, Publishing& publishing, std::string prefix, Log log)
      : front_(front), publishing_(publishing), prefix_(std::move(prefix)), log_(std::move(log)) {}

  void step(std::int64_t now_us);

 private:
  void watch_messages();
  void watch_others(std::int64_t now_us);

  const LcmFront& front_;
  Publishing& publishing_;
  std::string prefix_;
  Log log_;
  bool mute_ = false;
  std::uint64_t heard_ = 0;                     // of others, as known last
  std::optional<std::int64_t> other_heard_us_;  // while there is one
};

}  // namespace bushd::daemon

#include "joggers.h"

#include "request.h"
#include "times.h"

namespace bushfaults {
namespace {

using bushd::sim::TimeNs;

constexpr std::uint32_t kJoggersStream = 409;  // of randomness
constexpr std::uint64_t kClients = 8;

}  // namespace

Joggers::Joggers(std::uint64_t seed) : random_(seed, kJoggersStream) {}

Request Joggers::begin(const std::string& motor) {
  Pressed pressed{.client = "j" + std::to_string(random_.below(kClients)),
                  .motor = motor,
                  .keepalive_ms = random_.magnitude(50, 2'000),
                  .dies = random_.one_in(4)};
  // A finger is on one key at a time.
  std::erase_if(pressed_, [&](const Pressed& other) { return other.client == pressed.client; });
  pressed_.push_back(pressed);
  return change(pressed);
}

Request Joggers::change(const Pressed& pressed) {
  Request request{.client = pressed.client, .ask = Ask::kJog};
  request.add(pressed.motor, 0);
  request.keepalive_ms = pressed.keepalive_ms;
  request.speed_in_steps = true;
  request.speed_micro = random_.magnitude(120, 4'000) * kMicro * (random_.one_in(2) ? 1 : -1);
  return request;
}

// Sometimes after so many steps: few enough, or enough, to stop in.
Request Joggers::let_go(const Pressed& pressed) {
  Request request = change(pressed);
  request.speed_micro = 0;
  if (random_.one_in(3)) request.steps_after = random_.magnitude(1, 3'000) - 1;
  return request;
}

Request Joggers::next(const Pressed& pressed) {
  Request request = change(pressed);
  if (!random_.one_in(4)) request.renew = true;
  return request;
}

// Sometimes too long.
TimeNs Joggers::pause_ns(const Pressed& pressed) {
  if (random_.one_in(40)) return 2 * pressed.keepalive_ms * kMs;
  return random_.between(pressed.keepalive_ms / 5, pressed.keepalive_ms * 4 / 5) * kMs;
}

std::vector<Request> Joggers::due(TimeNs now_ns) {
  std::vector<Request> all;
  for (Pressed& pressed : pressed_) {
    if (pressed.due_ns > now_ns) continue;
    if (pressed.due_ns == 0) {
      pressed.until_ns = now_ns + random_.magnitude(100, 8'000) * kMs;
    } else if (now_ns < pressed.until_ns) {
      all.push_back(next(pressed));
    } else {
      if (!pressed.dies) all.push_back(let_go(pressed));
      pressed.over = true;
    }
    pressed.due_ns = now_ns + pause_ns(pressed);
  }
  std::erase_if(pressed_, [](const Pressed& pressed) { return pressed.over; });
  return all;
}

}  // namespace bushfaults

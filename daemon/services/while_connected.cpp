#include "daemon/services/while_connected.h"

namespace bushd::daemon {

bool WhileConnected::take(const api::Asker& asker) {
  if (!asker.session || asker.session->transport() != api::Transport::kSocket) {
    asker.answer(
        api::Refused{"motors cannot be armed for as long as the client is connected: LCM does not "
                     "tell when it has gone; use the control socket, or arm them without that"});
    return false;
  }
  if (asker.session->gone()) {
    asker.answer(api::Refused{"its client has gone"});
    return false;
  }
  askers_.push_back(asker);
  return true;
}

std::vector<MotorId> WhileConnected::waiting(const api::Asker& asker) const {
  std::vector<MotorId> motors;
  for (const MotorId id : installation_.motors()) {
    const auto* armed = installation_[id].as<motion::Armed>();
    if (armed == nullptr || armed->stops) continue;
    const api::Asker* by = open_moves_.asker_of(id);
    if (by != nullptr && by->session == asker.session && by->number == asker.number) {
      motors.push_back(id);
    }
  }
  return motors;
}

void WhileConnected::step(std::int64_t now_us) {
  for (auto asker = askers_.begin(); asker != askers_.end();) {
    const std::vector<MotorId> motors = waiting(*asker);
    const bool gone = asker->session->gone();
    if (!gone && !motors.empty()) {
      ++asker;
      continue;
    }
    for (const MotorId id : motors) {
      const std::string why = "its client has gone";
      installation_[id].stop(why);
      // It may begin before its MCU hears of that.
      open_moves_.say(id, api::Outcome::kStopped,
                      {api::Outcome::kStopped, "stopped, because " + why});
    }
    if (!motors.empty()) moves_.stop(now_us, motors);
    asker = askers_.erase(asker);
  }
}

}  // namespace bushd::daemon

#include "daemon/services/position_compare.h"

#include <string>

#include "daemon/services/allowed.h"

namespace bushd::daemon {
namespace {

static_assert(api::PositionCompare::kDelayUs.most == BUSHD_POSITION_COMPARE_MAX_DELAY_US &&
              api::PositionCompare::kWidthUs.most == BUSHD_POSITION_COMPARE_MAX_WIDTH_US);

bushd_position_compare message_of(const api::PositionCompare& request, const motion::Motor& motor) {
  bushd_position_compare message{};
  message.motor = motor.output().value;
  message.width_us = 1;
  if (!request.arrivals.any()) return message;
  if (request.arrivals.positive) message.arrivals |= BUSHD_ARRIVES_POSITIVE;
  if (request.arrivals.negative) message.arrivals |= BUSHD_ARRIVES_NEGATIVE;
  message.position_steps =
      static_cast<std::int32_t>(*motor.scale().steps_of_position(request.position));
  message.delay_us = static_cast<std::uint32_t>(request.delay_us);
  message.width_us = static_cast<std::uint32_t>(request.width_us);
  return message;
}

}  // namespace

void PositionCompare::request(std::int64_t now_us, const api::Asker& asker,
                              const api::PositionCompare& request) {
  const auto motor = check(request);
  if (!motor) return asker.answer(api::Refused{motor.error().text()});
  Mcu& mcu = installation_.mcu_of(*motor);
  open_.emplace_back(asker, std::vector{mcu.id}, now_us);
  mcu.offers.requests->ask(mcu.on_bus(), message_of(request, installation_[*motor]));
}

Result<MotorId> PositionCompare::check(const api::PositionCompare& request) const {
  const auto id = installation_.find(request.motor);
  if (!id) return id;
  const Mcu& mcu = installation_.mcu_of(*id);
  if (const auto online = mcu.must_be_online(); !online) return fail(online.error());
  if (!mcu.can_compare_positions()) {
    return fail("MCU " + mcu.name() + " has no position compare output");
  }
  if (!request.arrivals.any()) return id;
  const auto position = installation_[*id].scale().steps_of_position(request.position);
  if (!position) return fail(request.motor + ": " + position.error().message);
  if (*position < -motion::Motor::kMaxPosition || *position > motion::Motor::kMaxPosition) {
    return fail(request.motor + ": positions lie within +-" +
                std::to_string(motion::Motor::kMaxPosition));
  }
  if (!api::PositionCompare::kDelayUs.has(request.delay_us)) {
    return fail("a delay of " + std::to_string(request.delay_us) + " us before the pulse" +
                allowed(api::PositionCompare::kDelayUs));
  }
  if (!api::PositionCompare::kWidthUs.has(request.width_us)) {
    return fail("a pulse of " + std::to_string(request.width_us) + " us" +
                allowed(api::PositionCompare::kWidthUs));
  }
  return id;
}

void PositionCompare::follow(std::int64_t now_us, const Mcu* reported) {
  std::erase_if(open_, [&](Confirmation& confirmation) {
    const auto ended = confirmation.follow(now_us, reported, installation_,
                                           [](const Mcu&) { return Result<void>(); });
    if (ended) confirmation.answer(*ended);
    return ended.has_value();
  });
}

}  // namespace bushd::daemon

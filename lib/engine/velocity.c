#include "engine/velocity.h"

uint16_t bushd_velocity_period(int32_t speed, int32_t least) {
  if (speed < 0) speed = -speed;
  if (speed < least) speed = least;
  const uint32_t period = BUSHD_VELOCITY_PERIOD_OF_ONE / (uint32_t)speed;
  return (uint16_t)(period == 0 ? 1u : period);
}

void bushd_velocity_update(bushd_velocity* velocity) {
  if (velocity->now == velocity->wanted) return;
  if (velocity->now < velocity->wanted) {
    velocity->now += velocity->change;
    if (velocity->now > velocity->wanted) velocity->now = velocity->wanted;
  } else {
    velocity->now -= velocity->change;
    if (velocity->now < velocity->wanted) velocity->now = velocity->wanted;
  }
  velocity->period = bushd_velocity_period(velocity->now, velocity->least);
}

void bushd_velocity_init(bushd_velocity* velocity, int32_t change, int32_t least) {
  velocity->wanted = velocity->now = 0;
  velocity->change = change;
  velocity->least = least;
  velocity->period = bushd_velocity_period(0, least);
  velocity->step_left = velocity->period;
  velocity->update_left = BUSHD_VELOCITY_UPDATE_INTERVALS;
}

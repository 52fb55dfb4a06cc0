#include "engine/velocity.h"

static void find_period(bushd_velocity* velocity) {
  int32_t speed = velocity->now < 0 ? -velocity->now : velocity->now;
  if (speed < velocity->least) speed = velocity->least;
  const uint32_t period = BUSHD_VELOCITY_PERIOD_OF_ONE / (uint32_t)speed;
  velocity->period = (uint16_t)(period == 0 ? 1u : period);
}

static void update(bushd_velocity* velocity) {
  if (velocity->now == velocity->wanted) return;
  if (velocity->now < velocity->wanted) {
    velocity->now += velocity->change;
    if (velocity->now > velocity->wanted) velocity->now = velocity->wanted;
  } else {
    velocity->now -= velocity->change;
    if (velocity->now < velocity->wanted) velocity->now = velocity->wanted;
  }
  find_period(velocity);
}

void bushd_velocity_init(bushd_velocity* velocity, int32_t change, int32_t least) {
  velocity->wanted = velocity->now = 0;
  velocity->change = change;
  velocity->least = least;
  find_period(velocity);
  velocity->step_left = velocity->period;
  velocity->update_left = BUSHD_VELOCITY_UPDATE_INTERVALS;
}

int8_t bushd_velocity_interval(bushd_velocity* velocity) {
  int8_t step = 0;
  if (--velocity->step_left == 0) {
    velocity->step_left = velocity->period;
    step = (int8_t)((velocity->now > 0) - (velocity->now < 0));
  }
  if (--velocity->update_left == 0) {
    velocity->update_left = BUSHD_VELOCITY_UPDATE_INTERVALS;
    update(velocity);
  }
  return step;
}

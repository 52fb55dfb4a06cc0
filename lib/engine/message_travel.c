// TRAVEL (engine/message_motion.h).
#include "engine/cursor.h"

size_t bushd_encode_travel(const bushd_travel* message, uint8_t* payload) {
  writer w = {payload};
  put8(&w, message->number);
  put8(&w, (uint8_t)message->kind);
  put8(&w, message->motor);
  put8(&w, (uint8_t)message->direction);
  put8(&w, (uint8_t)message->edge);
  put8(&w, message->sensor);
  put32(&w, message->steps);
  put32(&w, message->delay_us);
  put32(&w, message->wait_us);
  return (size_t)(w.at - payload);
}

static bool travel_in_range(const bushd_travel* message) {
  const bool at_edges = message->edge != BUSHD_EDGE_NONE;
  const bool is_none = message->number == 0 && message->direction == 0 && !at_edges &&
                       message->sensor == 0 && message->steps == 0 && message->delay_us == 0 &&
                       message->wait_us == 0;
  if (message->kind == BUSHD_TRAVEL_NONE) return is_none;
  if (message->number == 0 || (message->direction != 1 && message->direction != -1)) return false;
  if (message->steps == 0 || message->steps > INT32_MAX) return false;
  if (message->wait_us < BUSHD_TRAVEL_MIN_WAIT_US || message->wait_us > BUSHD_TRAVEL_MAX_WAIT_US) {
    return false;
  }
  if (message->kind == BUSHD_TRAVEL_STEP) {
    return message->steps == 1 && !at_edges && message->delay_us == 0 &&
           message->sensor < BUSHD_MOTORS_PER_MCU;
  }
  const uint32_t least_us = at_edges ? BUSHD_TRIGGER_MIN_DELAY_US : 0;
  const uint32_t most_us = at_edges ? BUSHD_TRIGGER_MAX_DELAY_US : 0;
  return message->sensor == 0 && message->delay_us >= least_us && message->delay_us <= most_us;
}

bushd_status bushd_decode_travel(const uint8_t* payload, size_t size, bushd_travel* message) {
  reader r = read_from(payload, size);
  message->number = get8(&r);
  const uint8_t kind = get8(&r);
  message->motor = get8(&r);
  message->direction = (int8_t)get8(&r);
  const uint8_t edge = get8(&r);
  message->sensor = get8(&r);
  message->steps = get32(&r);
  message->delay_us = get32(&r);
  message->wait_us = get32(&r);
  message->kind = kind == BUSHD_TRAVEL_STEP     ? BUSHD_TRAVEL_STEP
                  : kind == BUSHD_TRAVEL_LIMITS ? BUSHD_TRAVEL_LIMITS
                                                : BUSHD_TRAVEL_NONE;
  message->edge = edge == BUSHD_EDGE_RISING    ? BUSHD_EDGE_RISING
                  : edge == BUSHD_EDGE_FALLING ? BUSHD_EDGE_FALLING
                                               : BUSHD_EDGE_NONE;
  return finish(&r, kind <= BUSHD_TRAVEL_LIMITS && edge <= BUSHD_EDGE_FALLING &&
                        message->motor < BUSHD_MOTORS_PER_MCU && travel_in_range(message));
}

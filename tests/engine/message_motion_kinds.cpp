// HOME, TRAVEL, LOCAL, POSITION_COMPARE, EMERGENCY.
#include "engine/message_kinds.h"

namespace bushd::test {
namespace {

void tell(const bushd_home& m, Fields& f) {
  f.add("motor", m.motor, 0, kLastMotor).add("direction", m.direction, -1, 1);
  f.promise(m.direction != 0, "direction");
  f.add("most_steps", m.most_steps, 0, INT32_MAX).add("shortest_delay", m.shortest_delay);
  f.add("slow_steps", m.slow_steps, 1, INT32_MAX).add("slow_delay", m.slow_delay, 1, INT64_MAX);
  f.add("position_steps", m.position_steps);
}

void tell(const bushd_travel& m, Fields& f) {
  f.add("number", m.number).add("kind", m.kind, 0, BUSHD_TRAVEL_LIMITS);
  f.add("motor", m.motor, 0, kLastMotor).add("direction", m.direction, -1, 1);
  f.add("edge", m.edge, 0, BUSHD_EDGE_FALLING).add("sensor", m.sensor, 0, 15);
  f.add("steps", m.steps, 0, INT32_MAX).add("delay_us", m.delay_us, 0, BUSHD_TRIGGER_MAX_DELAY_US);
  f.add("wait_us", m.wait_us, 0, BUSHD_TRAVEL_MAX_WAIT_US);
  if (m.kind == BUSHD_TRAVEL_NONE) {
    f.promise(m.number == 0 && m.steps == 0 && m.wait_us == 0, "something to give up");
    return;
  }
  f.promise(m.number != 0, "number").promise(m.direction != 0, "direction");
  f.promise(m.steps >= 1, "steps").promise(m.wait_us >= BUSHD_TRAVEL_MIN_WAIT_US, "wait_us");
  const bool at_edge = m.edge != BUSHD_EDGE_NONE;
  f.promise(at_edge ? m.delay_us >= BUSHD_TRIGGER_MIN_DELAY_US : m.delay_us == 0, "delay_us");
  const bool one_step = m.kind == BUSHD_TRAVEL_STEP;
  f.promise(!one_step || (m.steps == 1 && !at_edge), "a step that is none");
}

void tell(const bushd_local& m, Fields& f) {
  f.add("motors", m.motors).add("keypad", m.keypad).add("keypad_ticks", m.keypad_ticks);
}

void tell(const bushd_position_compare& m, Fields& f) {
  f.add("motor", m.motor, 0, kLastMotor);
  f.add("arrivals", m.arrivals, 0, BUSHD_ARRIVES_POSITIVE | BUSHD_ARRIVES_NEGATIVE);
  f.add("position_steps", m.position_steps);
  f.add("delay_us", m.delay_us, 0, BUSHD_POSITION_COMPARE_MAX_DELAY_US);
  f.add("width_us", m.width_us, 1, BUSHD_POSITION_COMPARE_MAX_WIDTH_US);
}

void tell(const bushd_emergency& m, Fields& f) {
  f.add("mode", m.mode, 0, BUSHD_STOP_DISABLE);
}

Bytes any_travel() {
  const uint8_t edge = between<uint8_t>(0, 2);
  const bool steps = edge == 0 && *rc::gen::arbitrary<bool>();
  bushd_travel m{};
  m.number = between<uint8_t>(1, 255);
  m.kind = steps ? BUSHD_TRAVEL_STEP : BUSHD_TRAVEL_LIMITS;
  m.motor = between<uint8_t>(0, 15);
  m.direction = *rc::gen::element<int8_t>(1, -1);
  m.edge = static_cast<bushd_edge>(edge);
  m.sensor = steps ? between<uint8_t>(0, 15) : uint8_t{0};
  m.steps = steps ? 1 : between<uint32_t>(1, INT32_MAX);
  m.delay_us = edge != 0 ? between<uint32_t>(50, 1'650'000) : 0;
  m.wait_us = between<uint32_t>(50, 1'650'000);
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_travel(&m, payload.data()));
  return payload;
}

}  // namespace

Kinds motion_kinds() {
  return {
      {"home",
       {bytes_with(18,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 15);
                     (*p)[1] = *rc::gen::element<uint8_t>(1, 0xFF);
                     (*p)[5] &= 0x7F;
                     (*p)[11] &= 0x7F;
                     (*p)[8] |= 1;
                     (*p)[12] |= 1;
                   }),
        codec(bushd_decode_home, bushd_encode_home, tell),
        {{"motor 16", set8(0, 16)},
         {"no direction", set8(1, 0)},
         {"twice the direction", set8(1, 2)},
         {"too many steps", set32(2, 0x80000000)},
         {"no slow steps", set32(8, 0)},
         {"too many slow steps", set32(8, 0x80000000)},
         {"no delay", set16(12, 0)},
         {"longer delays that are none", [](Bytes* p) { p->resize(26); }}}}},
      {"travel",
       {any_travel,
        codec(bushd_decode_travel, bushd_encode_travel, tell),
        {{"no number", set8(0, 0)},
         {"kind 3", set8(1, 3)},
         {"something to give up", set8(1, 0)},
         {"motor 16", set8(2, 16)},
         {"no direction", set8(3, 0)},
         {"no such edge", set8(4, 3)},
         {"sensor 16", set8(5, 16)},
         {"no step", set32(6, 0)},
         {"too many steps", set32(6, 0x80000000)},
         {"too long a delay", set32(10, 1'650'001)},
         {"too short a wait", set32(14, 49)},
         {"too long a wait", set32(14, 1'650'001)}}}},
      {"local",
       {[] { return random_bytes(6); }, codec(bushd_decode_local, bushd_encode_local, tell), {}}},
      {"position_compare",
       {bytes_with(14,
                   [](Bytes* p) {
                     (*p)[0] = between<uint8_t>(0, 15);
                     (*p)[1] = between<uint8_t>(0, 3);
                     bushd_put_u32(p->data() + 6, between<uint32_t>(0, 1'500'000));
                     bushd_put_u32(p->data() + 10, between<uint32_t>(1, 1'000'000));
                   }),
        codec(bushd_decode_position_compare, bushd_encode_position_compare, tell),
        {{"motor 16", set8(0, 16)},
         {"no such arrival", set8(1, 4)},
         {"too long a delay", set32(6, 1'500'001)},
         {"no width", set32(10, 0)},
         {"too wide", set32(10, 1'000'001)}}}},
      {"emergency",
       {bytes_with(1, [](Bytes* p) { (*p)[0] = between<uint8_t>(0, 2); }),
        codec(bushd_decode_emergency, bushd_encode_emergency, tell),
        {{"no such way", set8(0, 3)}}}},
  };
}

}  // namespace bushd::test

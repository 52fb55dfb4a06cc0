// PROGRAM_PUT, PROGRAM, PROGRAM_STATE.
#include "engine/message_kinds.h"

namespace bushd::test {
namespace {

void tell(const bushd_program_put& m, Fields& f) {
  f.add("offset", m.offset).add("total", m.total).add_part("bytes", m.bytes, m.count, 1);
  f.promise(m.count >= 1 && uint32_t{m.offset} + m.count <= m.total, "count");
}

void tell(const bushd_program_control& m, Fields& f) {
  f.add("action", m.action, 0, BUSHD_PROGRAM_RESUME);
  f.add("number", m.number).add("value", m.value);
  f.promise((m.number != 0) == (m.action == BUSHD_PROGRAM_RUN), "number");
  const bool any = m.action == BUSHD_PROGRAM_COMMIT || m.action == BUSHD_PROGRAM_RUN;
  const uint32_t most = m.action == BUSHD_PROGRAM_STOP ? BUSHD_STOP_IMMEDIATE : 0;
  f.promise(any || m.value <= most, "value");
}

void tell(const bushd_program_state& m, Fields& f) {
  f.add("stage", m.stage, 0, BUSHD_PROGRAM_ENDED);
  f.add("reason", m.reason, 0, BUSHD_PROGRAM_TRAVELLED);
  f.add("number", m.number).add("flags", m.flags);
  f.add("motors", m.motors).add("memory", m.memory).add("size", m.size, 0, m.memory);
  f.add("crc", m.crc).add("frame", m.frame).add("point", m.point).add("repeats", m.repeats);
  f.add("start_tick", m.start_tick).add("tick", m.tick);
}

// The last part: with a byte more it would lead beyond the end.
Bytes any_program_put() {
  const auto count = between<uint16_t>(1, BUSHD_PROGRAM_PUT_MAX);
  Bytes payload(4);
  const auto total = between<uint16_t>(count, UINT16_MAX);
  bushd_put_u16(&payload[0], static_cast<uint16_t>(total - count));
  bushd_put_u16(&payload[2], total);
  const Bytes bytes = random_bytes(count);
  payload.insert(payload.end(), bytes.begin(), bytes.end());
  return payload;
}

Bytes any_program_control() {
  bushd_program_control m{};
  m.action = between<uint8_t>(0, 5);
  if (m.action == BUSHD_PROGRAM_RUN) m.number = between<uint8_t>(1, 255);
  const bool any = m.action == BUSHD_PROGRAM_RUN || m.action == BUSHD_PROGRAM_COMMIT;
  if (any) m.value = between<uint32_t>(0, UINT32_MAX);
  if (m.action == BUSHD_PROGRAM_STOP) m.value = between<uint32_t>(0, 1);
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_program_control(&m, payload.data()));
  return payload;
}

}  // namespace

Kinds program_kinds() {
  return {{"program_put",
           {any_program_put,
            codec(bushd_decode_program_put, bushd_encode_program_put, tell),
            {},
            true}},
          {"program_control",
           {any_program_control,
            codec(bushd_decode_program_control, bushd_encode_program_control, tell),
            {{"action 6", set8(0, 6)},
             {"a run without a number",
              [](Bytes* p) {
                (*p)[0] = BUSHD_PROGRAM_RUN;
                (*p)[1] = 0;
              }},
             {"a number of what is no run",
              [](Bytes* p) {
                (*p)[0] = BUSHD_PROGRAM_COMMIT;
                (*p)[1] = 1;
              }},
             {"a stop of a third kind",
              [](Bytes* p) {
                (*p)[0] = BUSHD_PROGRAM_STOP;
                (*p)[1] = 0;
                bushd_put_u32(&(*p)[2], 2);
              }},
             {"the value of what has none",
              [](Bytes* p) {
                (*p)[0] = BUSHD_PROGRAM_PAUSE;
                (*p)[1] = 0;
                bushd_put_u32(&(*p)[2], 1);
              }}}}},
          {"program_state",
           {bytes_with(30,
                       [](Bytes* p) {
                         (*p)[0] = between<uint8_t>(0, 8);
                         (*p)[1] = between<uint8_t>(0, 11);
                         const auto memory = between<uint16_t>(0, UINT16_MAX);
                         bushd_put_u16(&(*p)[6], memory);
                         bushd_put_u16(&(*p)[8], between<uint16_t>(0, memory));
                       }),
            codec(bushd_decode_program_state, bushd_encode_program_state, tell),
            {{"stage 9", set8(0, 9)},
             {"reason 12", set8(1, 12)},
             {"more than it has memory", [](Bytes* p) {
                bushd_put_u16(&(*p)[6], 7);
                bushd_put_u16(&(*p)[8], 8);
              }}}}}};
}

}  // namespace bushd::test

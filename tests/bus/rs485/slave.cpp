#include "bus/rs485/slave.h"

#include <algorithm>
#include <utility>

#include "engine/payload.h"

namespace bushd::test {

namespace {

// By what the last report told: an MCU may keep all of it.
std::uint8_t sections_with_news(const bushd_report& last, const bushd_report& now) {
  const auto part = [&](auto... fields) { return ((last.*fields != now.*fields) || ...); };
  using R = bushd_report;
  unsigned sections = 0;
  if (part(&R::reset_cause, &R::failed_tests, &R::motor_count)) sections |= BUSHD_TELLS_BOOT;
  if (part(&R::sync_id, &R::sync_tick, &R::sync_ns, &R::rate_ppb)) sections |= BUSHD_TELLS_SYNC;
  if (part(&R::inputs, &R::forbidden_positive, &R::forbidden_negative, &R::system_inputs)) {
    sections |= BUSHD_TELLS_INPUTS;
  }
  if (part(&R::bad_frames, &R::rejected_frames, &R::last_rejection, &R::ramp_downs)) {
    sections |= BUSHD_TELLS_COUNTERS;
  }
  const bool moves = (now.running | now.autonomous | now.out_of_order) != 0;
  if (moves || now.low_water_ticks != UINT16_MAX) sections |= BUSHD_TELLS_MOTION;
  if (part(&R::homed, &R::homing, &R::armed, &R::trigger_number, &R::trigger_state, &R::start_tick,
           &R::start_ns)) {
    sections |= BUSHD_TELLS_AUTONOMOUS;
  }
  return static_cast<std::uint8_t>(sections);
}

std::uint16_t motors_with_news(const bushd_report& last, const bushd_report& now) {
  unsigned motors = now.moving;
  for (unsigned m = 0; m < now.motor_count; ++m) {
    const bool rests = now.motor[m].known_until == static_cast<std::uint16_t>(now.tick + 2);
    const bool stays = now.motor[m].position_steps == last.motor[m].position_steps;
    if (!rests || !stays) motors |= 1u << m;
  }
  return static_cast<std::uint16_t>(motors);
}

void choose_news(bushd_report& last, bushd_report& now, const bushd_poll_entry& entry) {
  now.number = static_cast<std::uint8_t>(last.number % 255 + 1);
  if (now.number == entry.known) now.number = static_cast<std::uint8_t>(now.number % 255 + 1);
  now.sections = 63;
  now.motors = static_cast<std::uint16_t>((1u << now.motor_count) - 1u);
  if (entry.known != 0 && entry.known == last.number) {
    now.sections = sections_with_news(last, now);
    now.motors = motors_with_news(last, now);
  }
  if (bushd_report_size(now.sections, now.motors) > entry.room) {
    now.number = now.sections = 0;
    now.motors = 0;
    return;
  }
  last = now;
}

}  // namespace

FakeBus::FakeBus(int count, int motors, bushd_format format, std::uint32_t tick_ns,
                 std::uint32_t baud) {
  for (int i = 0; i < 200; ++i) codes.push_back(static_cast<std::uint16_t>(250 - i));
  table.accel = {codes.data(), 200, nullptr, nullptr, 0};
  table.decel = {codes.data() + 50, 150, nullptr, nullptr, 0};
  table.cruise = 40;
  table.time_unit_ns = 40'000;
  setup = {.baud = baud, .tick_ns = tick_ns, .format = format, .mcus = {}};
  for (int i = 0; i < count; ++i) {
    link::McuSetup mcu;
    mcu.address = {static_cast<std::uint8_t>(i + 1)};
    mcu.tables = {{&table, 7}};
    std::fill_n(mcu.table_of_motor.begin(), motors, std::uint8_t{0});
    setup.mcus.push_back(mcu);
    Slave slave;
    slave.address = mcu.address.value;
    slave.identity.motors = static_cast<std::uint8_t>(motors);
    slave.identity.unique_id[0] = static_cast<std::uint8_t>(100 + i);
    slave.zero_us = -1'000'000 - 12'345 * i;
    slaves.push_back(slave);
  }
  master = std::make_unique<link::Rs485Master>(setup, source);
  master->port_opened(now_us);
}

std::uint32_t FakeBus::tick_of(const Slave& slave) const {
  return static_cast<std::uint32_t>((now_us - slave.zero_us) * 1000 / setup.tick_ns);
}

void FakeBus::connect() {
  ASSERT_TRUE(run_until([this] {
    for (std::size_t i = 0; i < slaves.size(); ++i) {
      if (!online(i)) return false;
    }
    return true;
  })) << master->view(McuIndex{0}).detail;
}

std::vector<Heard> FakeBus::heard_of(std::uint8_t type) const {
  std::vector<Heard> found;
  std::copy_if(heard.begin(), heard.end(), std::back_inserter(found),
               [&](const Heard& h) { return h.type == type; });
  return found;
}

void FakeBus::run_for(std::int64_t us) {
  run_until([] { return false; }, us);
}

bool FakeBus::run_until(const std::function<bool()>& done, std::int64_t limit_us) {
  const std::int64_t limit = now_us + limit_us;
  while (now_us < limit) {
    if (done()) return true;
    advance(limit);
  }
  return done();
}

void FakeBus::advance(std::int64_t limit_us) {
  const std::int64_t from = std::max(line_free_us_, now_us);
  std::int64_t at = from;
  std::size_t sent = 0;
  for (const std::uint8_t byte : master->step(now_us)) {
    at = from + line_us(++sent);
    ++master_bytes;
    bushd_frame frame;
    const bushd_receive received = bushd_receive_byte(&receiver_, byte, &frame);
    if (received == BUSHD_RECEIVE_MORE) continue;
    ASSERT_EQ(received, BUSHD_RECEIVE_FRAME) << "the master sends whole frames";
    const Heard h{
        at, frame.address, frame.type, {frame.payload, frame.payload + frame.payload_size}};
    frames_.emplace(at, std::pair{h, frame.sequence});
  }
  line_free_us_ = std::max(line_free_us_, at);
  for (const link::Event& event : master->take_events()) events.push_back(event);

  std::int64_t next = std::min(std::max(master->next_wake_us(), now_us + 1), limit_us);
  if (!frames_.empty()) next = std::min(next, frames_.begin()->first);
  next = std::min(next, read_due_us());
  now_us = std::max(next, now_us);
  while (!frames_.empty() && frames_.begin()->first <= now_us) {
    const auto [frame, sequence] = frames_.begin()->second;
    frames_.erase(frames_.begin());
    heard.push_back(frame);
    hear(frame, sequence);
  }
  if (now_us >= read_due_us()) read();
  for (const link::Event& event : master->take_events()) events.push_back(event);
}

std::int64_t FakeBus::read_due_us() const {
  if (arrivals_.empty()) return INT64_MAX;
  return std::max(arrivals_.begin()->first + adapter_latency_us, master->listen_from_us());
}

void FakeBus::read() {
  ++reads;
  Bytes bytes;
  while (!arrivals_.empty() && arrivals_.begin()->first + adapter_latency_us <= now_us) {
    const Bytes& more = arrivals_.begin()->second;
    bytes.insert(bytes.end(), more.begin(), more.end());
    arrivals_.erase(arrivals_.begin());
  }
  master->receive(now_us, bytes);
}

std::int64_t FakeBus::line_us(std::size_t bytes) const {
  return static_cast<std::int64_t>(bytes) * 10'000'000 / setup.baud;
}

void FakeBus::hear(const Heard& frame, std::uint8_t sequence) {
  for (Slave& slave : slaves) {
    follow_time(slave);
    const bool for_it = frame.address == slave.address || frame.address == BUSHD_ADDRESS_BROADCAST;
    if (for_it && slave.answers && !slave.loses(frame)) act(slave, frame, sequence);
  }
}

void FakeBus::follow_time(Slave& slave) {
  const std::uint32_t open = tick_of(slave) + 2;
  for (std::size_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (static_cast<std::int32_t>(open - slave.known_until[m]) <= 0) continue;
    slave.known_until[m] = open;
    if (slave.delay[m] != 0) slave.faults |= BUSHD_FAULT_LINK;
    slave.delay[m] = 0;
    slave.out_of_order[m].reset();
    slave.run[m].reset();
  }
}

void FakeBus::act(Slave& slave, const Heard& frame, std::uint8_t sequence) {
  const auto refusal = slave.refusals.find(frame.type);
  const std::uint8_t status = refusal == slave.refusals.end() ? 0 : refusal->second;
  const Bytes& p = frame.payload;
  switch (frame.type) {
    case BUSHD_MSG_IDENTIFY: {
      bushd_identify identify;
      ASSERT_EQ(bushd_decode_identify(p.data(), p.size(), &identify), BUSHD_OK);
      const std::uint8_t window =
          bushd_identify_window(slave.identity.unique_id, identify.salt, identify.windows);
      return answer(slave, frame, sequence, payload_of(slave.identity, bushd_encode_identity),
                    std::int64_t{window} * identify.window_units * 10);
    }
    case BUSHD_MSG_POLL: {
      bushd_poll poll;
      ASSERT_EQ(bushd_decode_poll(p.data(), p.size(), &poll), BUSHD_OK);
      bushd_poll_entry entry;
      if (!bushd_poll_find(&poll, slave.address, &entry)) return;
      return answer(slave, frame, sequence, report(slave, entry),
                    std::int64_t{entry.begin_units} * 10);
    }
    case BUSHD_MSG_SYNC: {
      bushd_sync sync;
      ASSERT_EQ(bushd_decode_sync(p.data(), p.size(), &sync), BUSHD_OK);
      const bool marked =
          (slave.flags & BUSHD_FLAG_SYNC_HEARD) && sync.follow_up_id == slave.sync_id;
      const std::int64_t zero_us =
          slave.sync_us - (std::int64_t{sync.sync_tick} * setup.tick_ns + sync.sync_ns) / 1000;
      // Its clock is exact: once in step it stays so, unless it is told another time.
      const bool off = std::abs(zero_us - slave.zero_us) > setup.tick_ns / 2000;
      if (sync.follows && marked && ((slave.flags & BUSHD_FLAG_SYNCED) == 0 || off)) {
        slave.zero_us = zero_us;
        slave.flags |= BUSHD_FLAG_SYNCED;
        slave.known_until.fill(tick_of(slave) + 2);
      }
      slave.sync_id = sync.sync_id;
      slave.sync_us = frame.at_us;
      slave.flags |= BUSHD_FLAG_SYNC_HEARD;
      return;
    }
    case BUSHD_MSG_TICKS:
      return take_ticks(slave, read_ticks(frame));
    case BUSHD_MSG_TABLE_TICKS:
      return take_ticks(slave, read_table_ticks(frame));
    case BUSHD_MSG_TABLE_RUN:
      return take_table_run(slave, frame);
    case BUSHD_MSG_EMERGENCY:
      slave.faults |= BUSHD_FAULT_EMERGENCY;
      slave.delay.fill(0);
      slave.run.fill({});
      slave.known_until.fill(tick_of(slave) + 2);
      return;
    case BUSHD_MSG_TABLES: {
      bushd_tables tables{};
      for (const auto& [bank, held] : slave.held) tables.bank[bank] = held;
      return answer(slave, frame, sequence, payload_of(tables, bushd_encode_tables));
    }
    case BUSHD_MSG_PROGRAM_STATE: {
      slave.program_state.tick = tick_of(slave);
      const Bytes state = payload_of(slave.program_state, bushd_encode_program_state);
      return answer(slave, frame, sequence, status == 0 ? state : Bytes{status});
    }
    case BUSHD_MSG_PROGRAM_PUT:
      return answer(slave, frame, sequence, {status != 0 ? status : put_program(slave, frame)});
    case BUSHD_MSG_PROGRAM:
      return answer(slave, frame, sequence, {status != 0 ? status : control_program(slave, frame)});
    default:
      break;
  }
  const bool at_rest_only =
      frame.type == BUSHD_MSG_INPUTS ||
      (frame.type == BUSHD_MSG_ASSIGN && (slave.program_state.motors >> p[0] & 1) != 0);
  if (at_rest_only && slave.runs_program()) {
    return answer(slave, frame, sequence, {BUSHD_E_STATE});
  }
  if (status == 0) {
    if (frame.type == BUSHD_MSG_CONFIGURE) slave.flags |= BUSHD_FLAG_CONFIGURED;
    if (frame.type == BUSHD_MSG_TABLE_BEGIN) {
      slave.tables[p[0]].clear();
      slave.held[p[0]] = {.valid = false, .crc = 0, .revision = bushd_get_u32(&p[11])};
    }
    if (frame.type == BUSHD_MSG_TABLE_END) {
      slave.held[p[0]].valid = true;
      slave.held[p[0]].crc = bushd_get_u32(&p[1]);
    }
    if (frame.type == BUSHD_MSG_TABLE_DATA) {
      for (std::size_t i = 0; i < p[3]; ++i) {
        slave.tables[p[0]].push_back(bushd_get_u16(&p[4 + 2 * i]));
      }
    }
    if (frame.type == BUSHD_MSG_ASSIGN) slave.table_of[p[0]] = p[1];
    if (frame.type == BUSHD_MSG_CONTROL) {
      if (p[0] & BUSHD_CONTROL_ENABLE) slave.flags |= BUSHD_FLAG_ENABLED;
      if (p[0] & BUSHD_CONTROL_DISABLE)
        slave.flags &= static_cast<std::uint8_t>(~BUSHD_FLAG_ENABLED);
      if (p[0] & BUSHD_CONTROL_CLEAR_FAULTS) {
        slave.faults &= static_cast<std::uint8_t>(p.size() > 1 ? ~p[1] : 0);
      }
      if (p[0] & BUSHD_CONTROL_FORGET_TABLES) {
        slave.tables.clear();
        slave.held.clear();
      }
    }
    if (frame.type == BUSHD_MSG_SET_POSITION) {
      slave.position[p[0]] = static_cast<std::int32_t>(bushd_get_u32(&p[1]));
    }
  }
  answer(slave, frame, sequence, {status});
}

FakeBus::Ticks FakeBus::read_ticks(const Heard& frame) {
  bushd_ticks ticks{};
  EXPECT_EQ(bushd_decode_ticks(frame.payload.data(), frame.payload.size(), &ticks), BUSHD_OK);
  Ticks read{ticks.epoch, ticks.flags, ticks.first_tick, ticks.count, {}};
  unsigned column = 0;
  for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((ticks.mask >> m & 1) == 0) continue;
    auto& [displacements, delay] = read.of_motor[m];
    for (unsigned i = 0; i < ticks.count; ++i) {
      const unsigned at = i * ticks.motors + column;
      displacements.push_back(ticks.flags & BUSHD_TICKS_FINE
                                  ? bushd_get_i16(ticks.displacements + 2 * at)
                                  : static_cast<std::int16_t>(ticks.displacements[at]));
    }
    delay = bushd_get_u16(ticks.delays + 2 * column);
    ++column;
  }
  return read;
}

FakeBus::Ticks FakeBus::read_table_ticks(const Heard& frame) const {
  bushd_table_ticks ticks{};
  EXPECT_EQ(bushd_decode_table_ticks(frame.payload.data(), frame.payload.size(), &ticks), BUSHD_OK);
  Ticks read{ticks.epoch, ticks.flags, ticks.first_tick, ticks.count, {}};
  std::uint16_t at = 0;
  bushd_table_ticks_entry entry;
  while (bushd_next_table_ticks_entry(&ticks, &at, &entry)) {
    bushd_run run;
    EXPECT_TRUE(bushd_run_restore(&run, &table, &entry.state));
    auto& [displacements, delay] = read.of_motor[entry.motor];
    displacements.resize(ticks.count);
    if (setup.format == BUSHD_FORMAT_FINE) {
      bushd_run_expand_fine(&run, setup.tick_ns, ticks.count, displacements.data(), 1);
    } else {
      Bytes coarse(ticks.count);
      bushd_run_expand_coarse(&run, setup.tick_ns, ticks.count, coarse.data(), 1);
      std::copy(coarse.begin(), coarse.end(), displacements.begin());
    }
    delay = static_cast<std::uint16_t>(bushd_run_delay(&run));
  }
  return read;
}

// The rules of docs/protocol.md, "Streams".
void FakeBus::take_ticks(Slave& slave, const Ticks& ticks) {
  const bool replace = ticks.flags & BUSHD_TICKS_REPLACE;
  const bool start = ticks.flags & BUSHD_TICKS_START;
  const auto ahead = static_cast<std::int8_t>(ticks.epoch - slave.epoch);
  const auto count = static_cast<std::int32_t>(ticks.count);
  bool good = (replace ? ahead > 0 : ahead == 0) && slave.faults == 0;
  bool news = false;
  for (const auto& entry : ticks.of_motor) {
    const unsigned m = entry.first;
    const auto first = static_cast<std::int32_t>(ticks.first_tick - slave.known_until[m]);
    const bool moves = slave.delay[m] != 0;
    const auto& out_of_order = slave.out_of_order[m];
    if (replace) {
      good &= (moves ? first <= 0 : first < 0) &&
              static_cast<std::int32_t>(ticks.first_tick - tick_of(slave)) >= 2;
      news = true;
    } else if (first + count > 0) {
      const bool joins =
          first <= 0 || !out_of_order ||
          (ticks.first_tick >= out_of_order->from && ticks.first_tick <= out_of_order->until);
      good &= start ? !moves && first >= 0 : moves && joins;
      news = true;
    }
  }
  if (!good || !news) {
    ++slave.rejected;
    return;
  }
  for (const auto& entry : ticks.of_motor) take_motor_ticks(slave, entry.first, ticks);
  if (replace) slave.epoch = ticks.epoch;
}

void FakeBus::take_motor_ticks(Slave& slave, unsigned m, const Ticks& ticks) const {
  const bool replace = ticks.flags & BUSHD_TICKS_REPLACE;
  const bool start = ticks.flags & BUSHD_TICKS_START;
  const auto& [displacements, delay] = ticks.of_motor.at(m);
  const std::uint32_t end = ticks.first_tick + ticks.count;
  for (std::uint32_t i = 0; i < ticks.count; ++i) {
    const std::uint32_t tick = ticks.first_tick + i;
    if (!replace && static_cast<std::int32_t>(tick - slave.known_until[m]) < 0) continue;
    slave.taken[m][tick] = displacements[i];
  }
  auto& out_of_order = slave.out_of_order[m];
  if (replace) {
    slave.run[m].reset();
    out_of_order.reset();
  } else if (!start && ticks.first_tick > slave.known_until[m]) {
    if (!out_of_order) out_of_order = Slave::OutOfOrderRange{ticks.first_tick, end, delay};
    if (end > out_of_order->until)
      out_of_order = Slave::OutOfOrderRange{out_of_order->from, end, delay};
    return;
  }
  if (replace || end > slave.known_until[m]) {
    slave.known_until[m] = end;
    slave.delay[m] = delay;
  }
  if (out_of_order && slave.known_until[m] >= out_of_order->from) {
    if (out_of_order->until > slave.known_until[m]) {
      slave.known_until[m] = out_of_order->until;
      slave.delay[m] = out_of_order->delay;
    }
    out_of_order.reset();
  }
}

void FakeBus::take_table_run(Slave& slave, const Heard& frame) {
  bushd_table_run message{};
  ASSERT_EQ(bushd_decode_table_run(frame.payload.data(), frame.payload.size(), &message), BUSHD_OK);
  bool good = message.epoch == slave.epoch && slave.faults == 0;
  const std::uint8_t* at = message.entries;
  for (std::uint8_t i = 0; i < message.count; ++i) {
    const bushd_table_run_entry entry = bushd_next_table_run_entry(&at);
    good &= slave.delay[entry.motor] == 0 && message.first_tick >= slave.known_until[entry.motor];
  }
  if (!good) {
    ++slave.rejected;
    return;
  }
  at = message.entries;
  for (std::uint8_t i = 0; i < message.count; ++i) {
    const bushd_table_run_entry entry = bushd_next_table_run_entry(&at);
    slave.run[entry.motor] = entry;
    slave.known_until[entry.motor] =
        static_cast<std::uint32_t>(source.end(entry.motor));  // by its table
  }
}

Bytes FakeBus::report(Slave& slave, const bushd_poll_entry& entry) {
  follow_time(slave);
  bushd_report r{};
  const std::uint8_t ready = BUSHD_FLAG_CONFIGURED | BUSHD_FLAG_SYNCED | BUSHD_FLAG_ENABLED;
  r.tick = tick_of(slave);
  for (unsigned m = 0; m < slave.identity.motors; ++m) {
    if (slave.known_until[m] - r.tick > 2 || slave.delay[m] != 0) {
      r.moving |= static_cast<std::uint16_t>(1u << m);
    }
    if (slave.run[m]) r.running |= static_cast<std::uint16_t>(1u << m);
    r.motor[m] = {slave.position[m], static_cast<std::uint16_t>(slave.known_until[m])};
    if (!slave.out_of_order[m]) continue;
    const auto from = static_cast<std::uint16_t>(slave.out_of_order[m]->from);
    const auto until = static_cast<std::uint16_t>(slave.out_of_order[m]->until);
    if (r.out_of_order != 0 && (r.out_of_order_from != from || r.out_of_order_until != until))
      continue;
    r.out_of_order |= static_cast<std::uint16_t>(1u << m);
    r.out_of_order_from = from;
    r.out_of_order_until = until;
  }
  if (slave.runs_program()) {
    r.moving |= slave.program_state.motors;
    r.autonomous = r.running = slave.program_state.motors;
  }
  r.low_water_ticks = slave.low_water;
  r.state = slave.faults != 0                ? BUSHD_STATE_FAULT
            : (slave.flags & ready) != ready ? BUSHD_STATE_BUSY
            : r.moving != 0                  ? BUSHD_STATE_RUN
                                             : BUSHD_STATE_READY;
  r.faults = slave.faults;
  r.flags = slave.flags;
  r.epoch = slave.epoch;
  r.boot_number = slave.identity.boot_number;
  r.tick_ns = static_cast<std::uint32_t>((now_us - slave.zero_us) * 1000 % setup.tick_ns);
  r.sync_id = slave.sync_id;
  const std::int64_t sync_ns = (slave.sync_us - slave.zero_us) * 1000;
  r.sync_tick = static_cast<std::uint32_t>(sync_ns / setup.tick_ns);
  r.sync_ns = static_cast<std::uint32_t>(sync_ns % setup.tick_ns);
  r.rejected_frames = slave.rejected;
  r.motor_count = slave.identity.motors;
  slave.spoils(r);
  choose_news(slave.told, r, entry);
  return payload_of(r, bushd_encode_report);
}

void FakeBus::answer(const Slave& slave, const Heard& frame, std::uint8_t sequence,
                     const Bytes& payload, std::int64_t delay_us) {
  Bytes wire(1 + BUSHD_FRAME_MAX_WIRE);
  wire[0] = 0;
  wire.resize(1 + bushd_frame_encode(slave.address,
                                     static_cast<std::uint8_t>(frame.type | BUSHD_TYPE_REPLY),
                                     sequence, payload.data(), payload.size(), wire.data() + 1));
  slave_bytes += static_cast<std::int64_t>(wire.size());
  const std::int64_t begin = frame.at_us + std::max(turnaround_us, delay_us);
  const std::int64_t end = begin + line_us(wire.size());
  // Who talks at the same time spoils it for both.
  for (auto& [other_end, other] : arrivals_) {
    const std::int64_t other_begin = other_end - line_us(other.size());
    if (begin >= other_end || end <= other_begin) continue;
    wire[wire.size() / 2] ^= 0x55;
    other[other.size() / 2] ^= 0x55;
  }
  arrivals_.emplace(end, wire);
}

}  // namespace bushd::test

#include "link/slave.h"

#include <algorithm>
#include <utility>

namespace bushd::test {

FakeBus::FakeBus(int count, int motors, bushd_format format, std::uint32_t tick_ns) {
  for (int i = 0; i < 200; ++i) codes.push_back(static_cast<std::uint16_t>(250 - i));
  table.accel = {codes.data(), 200, nullptr, nullptr, 0};
  table.decel = {codes.data() + 50, 150, nullptr, nullptr, 0};
  table.cruise = 40;
  table.time_unit_ns = 40'000;
  setup = {.baud = kBaud, .tick_ns = tick_ns, .format = format, .mcus = {}};
  for (int i = 0; i < count; ++i) {
    link::McuSetup mcu;
    mcu.address = static_cast<std::uint8_t>(i + 1);
    mcu.tables = {&table};
    mcu.table_of_motor.fill(-1);
    std::fill_n(mcu.table_of_motor.begin(), motors, 0);
    setup.mcus.push_back(mcu);
    Slave slave;
    slave.address = mcu.address;
    slave.identity.motors = static_cast<std::uint8_t>(motors);
    slave.zero_us = -1'000'000 - 12'345 * i;
    slaves.push_back(slave);
  }
  master = std::make_unique<link::Master>(setup, source);
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
  })) << master->view(0).detail;
}

int FakeBus::count(link::Event::Kind kind) const {
  return static_cast<int>(
      std::count_if(events.begin(), events.end(), [&](const auto& e) { return e.kind == kind; }));
}

std::optional<link::Event> FakeBus::last(link::Event::Kind kind) const {
  const auto found =
      std::find_if(events.rbegin(), events.rend(), [&](const auto& e) { return e.kind == kind; });
  return found == events.rend() ? std::nullopt : std::optional(*found);
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
  std::int64_t at = std::max(line_free_us_, now_us);
  for (const std::uint8_t byte : master->step(now_us)) {
    at += 10'000'000 / kBaud;
    ++master_bytes;
    bushd_frame frame;
    const bushd_receive received = bushd_receive_byte(&receiver_, byte, &frame);
    if (received == BUSHD_RECEIVE_MORE) continue;
    ASSERT_EQ(received, BUSHD_RECEIVE_FRAME) << "the master sends whole frames";
    const Heard h{
        at, frame.address, frame.type, {frame.payload, frame.payload + frame.payload_size}};
    frames_.emplace(at, std::pair{h, frame.tag});
  }
  line_free_us_ = std::max(line_free_us_, at);
  for (const link::Event& event : master->take_events()) events.push_back(event);

  std::int64_t next = std::min(std::max(master->next_wake_us(), now_us + 1), limit_us);
  if (!frames_.empty()) next = std::min(next, frames_.begin()->first);
  if (!arrivals_.empty()) next = std::min(next, arrivals_.begin()->first);
  now_us = std::max(next, now_us);
  while (!frames_.empty() && frames_.begin()->first <= now_us) {
    const auto [frame, tag] = frames_.begin()->second;
    frames_.erase(frames_.begin());
    heard.push_back(frame);
    hear(frame, tag);
  }
  while (!arrivals_.empty() && arrivals_.begin()->first <= now_us) {
    const Bytes bytes = arrivals_.begin()->second;
    arrivals_.erase(arrivals_.begin());
    master->receive(now_us, bytes);
  }
  for (const link::Event& event : master->take_events()) events.push_back(event);
}

void FakeBus::hear(const Heard& frame, std::uint8_t tag) {
  for (Slave& slave : slaves) {
    follow_time(slave);
    const bool for_it = frame.address == slave.address || frame.address == BUSHD_ADDRESS_BROADCAST;
    if (for_it && slave.answers && !slave.loses(frame)) act(slave, frame, tag);
  }
}

void FakeBus::follow_time(Slave& slave) {
  const std::uint32_t open = tick_of(slave) + 2;
  for (std::size_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if (static_cast<std::int32_t>(open - slave.known_until[m]) <= 0) continue;
    slave.known_until[m] = open;
    if (slave.delay[m] != 0) slave.faults |= BUSHD_FAULT_LINK;
    slave.delay[m] = 0;
  }
}

void FakeBus::act(Slave& slave, const Heard& frame, std::uint8_t tag) {
  const auto refusal = slave.refusals.find(frame.type);
  const std::uint8_t status = refusal == slave.refusals.end() ? 0 : refusal->second;
  const Bytes& p = frame.payload;
  switch (frame.type) {
    case BUSHD_MSG_IDENTIFY: {
      Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
      payload.resize(bushd_encode_identity(&slave.identity, payload.data()));
      return answer(slave, frame, tag, payload);
    }
    case BUSHD_MSG_POLL:
      return answer(slave, frame, tag, report(slave));
    case BUSHD_MSG_SYNC: {
      bushd_sync sync;
      ASSERT_EQ(bushd_decode_sync(p.data(), p.size(), &sync), BUSHD_OK);
      const bool marked = (slave.flags & BUSHD_FLAG_MARK) && sync.mark_tag == slave.mark_tag;
      // Its clock is exact: once in step it stays so.
      if (sync.follows && marked && (slave.flags & BUSHD_FLAG_SYNCED) == 0) {
        slave.zero_us =
            slave.mark_us - (std::int64_t{sync.mark_tick} * setup.tick_ns + sync.mark_ns) / 1000;
        slave.flags |= BUSHD_FLAG_SYNCED;
        slave.known_until.fill(tick_of(slave) + 2);
      }
      slave.mark_tag = tag;
      slave.mark_us = frame.at_us;
      slave.flags |= BUSHD_FLAG_MARK;
      return;
    }
    case BUSHD_MSG_TICKS:
      return take_ticks(slave, frame);
    default:
      break;
  }
  if (status == 0) {
    if (frame.type == BUSHD_MSG_CONFIGURE) slave.flags |= BUSHD_FLAG_CONFIGURED;
    if (frame.type == BUSHD_MSG_TABLE_BEGIN) slave.tables[p[0]].clear();
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
      if (p[0] & BUSHD_CONTROL_CLEAR_FAULTS) slave.faults = 0;
    }
    if (frame.type == BUSHD_MSG_SET_POSITION) {
      slave.position[p[0]] = static_cast<std::int32_t>(bushd_get_u32(&p[1]));
    }
  }
  answer(slave, frame, tag, {status});
}

// The rules of docs/protocol.md, "Streams".
void FakeBus::take_ticks(Slave& slave, const Heard& frame) {
  bushd_ticks ticks;
  ASSERT_EQ(bushd_decode_ticks(frame.payload.data(), frame.payload.size(), &ticks), BUSHD_OK);
  const bool replace = ticks.flags & BUSHD_TICKS_REPLACE;
  const bool start = ticks.flags & BUSHD_TICKS_START;
  const auto ahead = static_cast<std::int8_t>(ticks.epoch - slave.epoch);
  bool good = (replace ? ahead > 0 : ahead == 0) && slave.faults == 0;
  bool news = false;
  for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((ticks.mask >> m & 1) == 0) continue;
    const auto first = static_cast<std::int32_t>(ticks.first_tick - slave.known_until[m]);
    const bool moves = slave.delay[m] != 0;
    if (replace) {
      good &= (moves ? first <= 0 : first < 0) &&
              static_cast<std::int32_t>(ticks.first_tick - tick_of(slave)) >= 2;
      news = true;
    } else if (first + ticks.count > 0) {
      good &= start ? !moves && first >= 0 : moves && first <= 0;
      news = true;
    }
  }
  if (!good || !news) {
    ++slave.rejected;
    return;
  }
  unsigned column = 0;
  for (unsigned m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    if ((ticks.mask >> m & 1) == 0) continue;
    for (unsigned i = 0; i < ticks.count; ++i) {
      const std::uint32_t tick = ticks.first_tick + i;
      if (!replace && static_cast<std::int32_t>(tick - slave.known_until[m]) < 0) continue;
      const unsigned at = i * ticks.motors + column;
      slave.taken[m][tick] = ticks.flags & BUSHD_TICKS_FINE
                                 ? bushd_get_i16(ticks.displacements + 2 * at)
                                 : static_cast<std::int16_t>(ticks.displacements[at]);
    }
    const std::uint32_t end = ticks.first_tick + ticks.count;
    if (replace || static_cast<std::int32_t>(end - slave.known_until[m]) > 0) {
      slave.known_until[m] = end;
      if (ticks.delays != nullptr) slave.delay[m] = bushd_get_u16(ticks.delays + 2 * column);
    }
    ++column;
  }
  if (replace) slave.epoch = ticks.epoch;
}

Bytes FakeBus::report(Slave& slave) {
  follow_time(slave);
  bushd_report r{};
  const std::uint8_t ready = BUSHD_FLAG_CONFIGURED | BUSHD_FLAG_SYNCED | BUSHD_FLAG_ENABLED;
  r.tick = tick_of(slave);
  for (unsigned m = 0; m < slave.identity.motors; ++m) {
    if (slave.known_until[m] - r.tick > 2 || slave.delay[m] != 0) {
      r.moving |= static_cast<std::uint16_t>(1u << m);
    }
    r.motor[m] = {slave.position[m], static_cast<std::uint16_t>(slave.known_until[m])};
  }
  r.state = slave.faults != 0                ? BUSHD_STATE_FAULT
            : (slave.flags & ready) != ready ? BUSHD_STATE_BUSY
            : r.moving != 0                  ? BUSHD_STATE_RUN
                                             : BUSHD_STATE_READY;
  r.faults = slave.faults;
  r.flags = slave.flags;
  r.epoch = slave.epoch;
  r.boot_number = slave.identity.boot_number;
  r.tick_ns = static_cast<std::uint32_t>((now_us - slave.zero_us) * 1000 % setup.tick_ns);
  r.mark_tag = slave.mark_tag;
  const std::int64_t mark_ns = (slave.mark_us - slave.zero_us) * 1000;
  r.mark_tick = static_cast<std::uint32_t>(mark_ns / setup.tick_ns);
  r.mark_ns = static_cast<std::uint32_t>(mark_ns % setup.tick_ns);
  r.rejected_frames = slave.rejected;
  r.motor_count = slave.identity.motors;
  Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
  payload.resize(bushd_encode_report(&r, payload.data()));
  return payload;
}

void FakeBus::answer(const Slave& slave, const Heard& frame, std::uint8_t tag,
                     const Bytes& payload) {
  Bytes wire(1 + BUSHD_FRAME_MAX_WIRE);
  wire[0] = 0;
  wire.resize(1 + bushd_frame_encode(slave.address,
                                     static_cast<std::uint8_t>(frame.type | BUSHD_TYPE_REPLY), tag,
                                     payload.data(), payload.size(), wire.data() + 1));
  slave_bytes += static_cast<std::int64_t>(wire.size());
  const std::int64_t end =
      frame.at_us + turnaround_us + static_cast<std::int64_t>(wire.size()) * 10'000'000 / kBaud;
  arrivals_.emplace(end, wire);
}

}  // namespace bushd::test

#include "firmware/rig.h"

#include <algorithm>
#include <bit>
#include <cstdlib>
#include <utility>

#include "sim/disabled_capabilities.h"

namespace bushd::test {
namespace {

constexpr std::uint32_t kTimeInTickNs = 1000;

template <class Message>
Message decoded(const std::optional<Answer>& answer,
                bushd_status (*decode)(const std::uint8_t*, std::size_t, Message*)) {
  Message message{};
  EXPECT_TRUE(answer);
  if (answer) {
    EXPECT_EQ(decode(answer->payload.data(), answer->payload.size(), &message), BUSHD_OK);
  }
  return message;
}

}  // namespace

std::vector<std::uint16_t> codes_of(const Law& law) {
  std::vector<std::uint16_t> codes = law.accel;
  codes.insert(codes.end(), law.decel.begin(), law.decel.end());
  return codes;
}

void append(Bytes& bytes, const std::vector<std::uint16_t>& codes) {
  for (const std::uint16_t code : codes) {
    bytes.push_back(static_cast<std::uint8_t>(code));
    bytes.push_back(static_cast<std::uint8_t>(code >> 8));
  }
}

std::uint32_t crc32(const Bytes& bytes) {
  std::uint32_t crc = 0xFFFFFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int i = 0; i < 8; ++i) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0u);
  }
  return ~crc;
}

Law ramp_law() {
  Law law;
  for (int i = 0; i < 24; ++i) law.accel.push_back(static_cast<std::uint16_t>(250 - 10 * i));
  for (int i = 0; i < 11; ++i) law.decel.push_back(static_cast<std::uint16_t>(180 - 16 * i));
  law.cruise = 20;
  law.unit_ns = 40'000;
  return law;
}

std::vector<int> steps_by_tick(const Reference& reference, std::uint32_t tick_ns) {
  std::vector<int> steps;
  std::size_t made = 0;
  for (std::uint64_t tick = 1; made < reference.steps(); ++tick) {
    const std::size_t now = reference.steps_at(tick * tick_ns);
    steps.push_back(static_cast<int>(now - made));
    made = now;
  }
  return steps;
}

Plan plan_move(const Law& law, std::int64_t steps, std::uint32_t tick_ns, bushd_format format) {
  const auto reference = Reference::move(law, static_cast<std::size_t>(std::abs(steps)));
  Plan plan;
  plan.direction = steps < 0 ? -1 : 1;
  std::int64_t before = 0;
  for (std::uint64_t tick = 1; before < std::abs(steps) * 256; ++tick) {
    const std::uint64_t end_ns = tick * tick_ns;
    const auto made = static_cast<std::int64_t>(reference.steps_at(end_ns));
    const bool fine = format == BUSHD_FORMAT_FINE;
    const std::int64_t position = fine ? reference.position_at(end_ns) : made * 256;
    const std::int64_t displacement = position - before;
    plan.displacement.push_back(static_cast<std::int16_t>(
        fine ? displacement * plan.direction : displacement / 256 | (steps < 0 ? 0 : 0x80)));
    plan.delay.push_back(reference.delay_at(end_ns));
    plan.fraction.push_back(static_cast<std::uint8_t>(position - made * 256));
    plan.made.push_back(made);
    before = position;
  }
  return plan;
}

Rig::Rig(RigOptions options)
    : options_(options),
      queue_(std::size_t{options.queue_ticks} * options.motors, 0x5A5A),  // as RAM may be at boot
      codes_(options.code_count, 0xA5A5),
      program_bytes_(options.program_bytes, 0x5A) {
  program_.bytes = program_bytes_.data();
  program_.memory = options.program_bytes;
  bushd_port port{};
  port.context = this;
  port.transmit = [](void* context, const std::uint8_t* wire, std::size_t size,
                     std::uint32_t delay_ns) {
    static_cast<Rig*>(context)->sent_.emplace_back(Bytes(wire, wire + size), delay_ns);
  };
  port.store_address = [](void* context, std::uint8_t address) {
    auto& rig = *static_cast<Rig*>(context);
    if (rig.options_.stores_address) rig.stored_address_ = address;
    return rig.options_.stores_address;
  };
  port.set_enable = [](void* context, bool on, const bushd_set_outputs* levels, bushd_edge off_at) {
    auto& rig = *static_cast<Rig*>(context);
    ++rig.enable_calls_;
    if (on && rig.switched_off_) {
      rig.enable_kept_ = false;
      return;
    }
    rig.switched_off_ = false;
    rig.enabled_ = on;
    rig.off_at_ = off_at;
    rig.levels_ = *levels;
  };
  port.set_tick = [](void* context, std::uint32_t ns) {
    static_cast<Rig*>(context)->port_tick_ns_ = ns;
  };
  port.adjust_tick = [](void*, std::int32_t) {};
  port.time_in_tick_ns = [](void*) { return kTimeInTickNs; };
  port.read_inputs = [](void* context) {
    const auto& rig = *static_cast<Rig*>(context);
    const bool latched = rig.switched_off_;
    bushd_inputs pins = rig.sense ? rig.sense() : rig.pins_;
    if (latched) {
      pins.system = static_cast<std::uint8_t>(rig.off_at_ == BUSHD_EDGE_RISING
                                                  ? pins.system | BUSHD_INPUT_EMERGENCY
                                                  : pins.system & ~BUSHD_INPUT_EMERGENCY);
    }
    return pins;
  };
  port.read_current = [](void* context) { return static_cast<Rig*>(context)->current_; };
  port.self_test = [](void* context) { return static_cast<Rig*>(context)->options_.failing_tests; };
  port.keep_enable = [](void* context, bool on) { static_cast<Rig*>(context)->enable_kept_ = on; };
  bushd_mcu_config config{};
  config.currents = currents_.data();
  config.current_motors = options.current_motors;
  config.velocity = velocity_.data();
  config.velocity_motors = options.velocity_motors;
  config.keypad = true;
  config.scratch = &scratch_;
  config.program = &program_;
  config.keeps_programs = options.keeps_programs;
  sim::disable_capabilities(options.disabled_capabilities, &config);
  // These are the port's: the core sees by itself that it gives no function for them.
  config.disabled_capabilities = static_cast<std::uint16_t>(
      config.disabled_capabilities & ~(BUSHD_CAN_TRIGGER | BUSHD_CAN_CURRENTS));
  if ((options.disabled_capabilities & BUSHD_CAN_TRIGGER) == 0) {
    port.set_trigger = [](void* context, bushd_edge edge) {
      static_cast<Rig*>(context)->awaited_edge_ = edge;
    };
  }
  if (config.current_motors > 0) {
    port.set_current = [](void* context, std::uint8_t motor, std::uint16_t ma, bool fast_decay) {
      static_cast<Rig*>(context)->windings_.push_back({motor, ma, fast_decay});
    };
  }
  config.address = options.address;
  config.motors = options.motors;
  config.slots = options.slots;
  config.boot_number = 77;
  config.reset_cause = options.reset_cause;
  config.enable_at_boot = options.enable_at_boot;
  config.in_pieces = options.in_pieces;
  config.queue = queue_.data();
  config.queue_ticks = options.queue_ticks;
  config.codes = codes_.data();
  config.code_count = options.code_count;
  config.reply = reply_.data();
  config.min_tick_ns = options.min_tick_ns;
  config.pulse_ns = options.pulse_ns;
  std::ranges::copy(unique_id(), config.unique_id);
  bushd_mcu_boot(&mcu_, &port, &config);
  slot_buffer_ = bushd_mcu_swap(&mcu_);
  bushd_mcu_prepare(&mcu_);
}

void Rig::restart_with_nvm(bushd_reset_cause cause) {
  std::vector<Bytes> kept;
  for (std::uint8_t i = 0;; ++i) {
    const bushd_mcu_nvm_region piece = bushd_mcu_nvm_region_at(&mcu_, i);
    if (piece.at == nullptr) break;
    const auto* const bytes = static_cast<const std::uint8_t*>(piece.at);
    kept.emplace_back(bytes, bytes + piece.size);
  }
  const bushd_port port = mcu_.port;
  bushd_mcu_config config = mcu_.config;
  config.reset_cause = cause;
  currents_ = {};
  velocity_ = {};
  std::ranges::fill(program_bytes_, std::uint8_t{0x5A});
  bushd_mcu_boot(&mcu_, &port, &config);
  for (std::uint8_t i = 0; i < kept.size(); ++i) {
    std::ranges::copy(kept[i], static_cast<std::uint8_t*>(bushd_mcu_nvm_region_at(&mcu_, i).at));
  }
  bushd_mcu_nvm_restored(&mcu_);
  slot_buffer_ = bushd_mcu_swap(&mcu_);
  bushd_mcu_prepare(&mcu_);
}

void Rig::feed(std::span<const std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) bushd_mcu_receive(&mcu_, byte, kTimeInTickNs);
}

void Rig::frame(std::uint8_t address, std::uint8_t type, const Bytes& payload) {
  std::array<std::uint8_t, BUSHD_FRAME_MAX_WIRE> wire;
  const std::size_t size =
      bushd_frame_encode(address, type, ++sequence_, payload.data(), payload.size(), wire.data());
  feed(std::span(wire).first(size));
}

std::optional<Answer> Rig::answer() {
  const auto sent = std::exchange(sent_, {});
  if (sent.empty()) return std::nullopt;
  last_sent_ = sent.front().first;
  EXPECT_EQ(sent.size(), 1u) << "one answer per request";
  bushd_receiver receiver{};
  std::optional<Answer> answer;
  for (const std::uint8_t byte : last_sent_) {
    bushd_frame frame;
    const bushd_receive received = bushd_receive_byte(&receiver, byte, &frame);
    if (received == BUSHD_RECEIVE_MORE) continue;
    EXPECT_EQ(received, BUSHD_RECEIVE_FRAME);
    EXPECT_FALSE(answer) << "one frame per answer";
    EXPECT_EQ(frame.address, mcu_.config.address);
    EXPECT_EQ(frame.sequence, sequence_);
    EXPECT_NE(frame.type & BUSHD_TYPE_REPLY, 0);
    answer = Answer{static_cast<std::uint8_t>(frame.type & ~BUSHD_TYPE_REPLY), frame.sequence,
                    Bytes(frame.payload, frame.payload + frame.payload_size), sent.front().second};
  }
  return answer;
}

bushd_status Rig::request(std::uint8_t type, const Bytes& payload) {
  frame(type, payload);
  const auto got = answer();
  EXPECT_TRUE(got) << "no answer to " << int{type};
  if (!got) return BUSHD_E_UNKNOWN_MESSAGE;
  EXPECT_EQ(got->type, type);
  return static_cast<bushd_status>(decoded(got, bushd_decode_acknowledgement).status);
}

bushd_identity Rig::identify() {
  frame(BUSHD_MSG_IDENTIFY, {0, 0, 1, 0, 0});
  return decoded(answer(), bushd_decode_identity);
}

bushd_status Rig::configure(bushd_format format, std::uint32_t tick_ns,
                            std::uint16_t comm_timeout_ticks) {
  const auto status = request(bushd_configure{tick_ns, format, comm_timeout_ticks});
  if (status == BUSHD_OK) format_ = format;
  return status;
}

bushd_status Rig::set_inputs(const InputSettings& settings) {
  return request(bushd_set_inputs{.limit_positive = settings.limit_positive,
                                  .limit_negative = settings.limit_negative,
                                  .limit_immediate = settings.limit_immediate,
                                  .inverted = settings.inverted,
                                  .debounce_ticks = settings.debounce_ticks,
                                  .system_inverted = settings.system_inverted,
                                  .emergency = settings.emergency,
                                  .overcurrent = settings.overcurrent,
                                  .enable_after_watchdog = settings.enable_after_watchdog});
}

std::string Rig::keypad_display() {
  std::string text;
  for (int c = bushd_mcu_keypad_display(&mcu_); c >= 0; c = bushd_mcu_keypad_display(&mcu_)) {
    text += static_cast<char>(c);
  }
  return text;
}

void Rig::sync(const bushd_sync& message) {
  frame(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_SYNC, request_of(message).payload);
  EXPECT_FALSE(answer()) << "SYNC is not answered";
}

void Rig::sync_to(std::uint32_t tick) {
  pass(4);  // a new tick length has settled
  const std::uint32_t sync_id = sync_id_ += 2;
  sync({1, sync_id, false, 0, 0, 0});
  sync({1, sync_id + 1, true, sync_id, tick, kTimeInTickNs});
  EXPECT_EQ(this->tick(), tick);
}

bushd_status Rig::begin(std::uint8_t bank, const Law& law, bool symmetric, std::uint32_t revision) {
  const bushd_table_begin message = {
      .bank = bank,
      .accel_count = static_cast<std::uint16_t>(law.accel.size()),
      .decel_count = static_cast<std::uint16_t>(symmetric ? 0 : law.decel.size()),
      .cruise = law.cruise,
      .time_unit_ns = law.unit_ns,
      .revision = revision};
  const Bytes payload = payload_of(message, bushd_encode_table_begin);
  table_head_[bank] = {payload.begin() + 1, payload.begin() + 11};  // no bank, no revision
  return request(BUSHD_MSG_TABLE_BEGIN, payload);
}

bushd_status Rig::data(std::uint8_t bank, std::uint16_t offset,
                       const std::vector<std::uint16_t>& codes) {
  return request(BUSHD_MSG_TABLE_DATA, payload_of([&](std::uint8_t* p) {
                   return bushd_encode_table_data(
                       bank, offset, static_cast<std::uint8_t>(codes.size()), codes.data(), p);
                 }));
}

bushd_status Rig::end(std::uint8_t bank, const std::vector<std::uint16_t>& codes) {
  Bytes bytes = table_head_[bank];
  append(bytes, codes);
  return request(bushd_table_end{bank, crc32(bytes)});
}

bushd_status Rig::upload(std::uint8_t bank, const Law& law) {
  if (const bushd_status status = begin(bank, law); status != BUSHD_OK) return status;
  const std::vector<std::uint16_t> codes = codes_of(law);
  for (std::size_t at = 0; at < codes.size(); at += BUSHD_TABLE_DATA_MAX_CODES) {
    const auto first = codes.begin() + static_cast<std::ptrdiff_t>(at);
    const auto size = std::min<std::size_t>(codes.size() - at, BUSHD_TABLE_DATA_MAX_CODES);
    const bushd_status status = data(bank, static_cast<std::uint16_t>(at),
                                     {first, first + static_cast<std::ptrdiff_t>(size)});
    if (status != BUSHD_OK) return status;
  }
  return end(bank, codes);
}

bushd_tables Rig::tables() {
  frame(BUSHD_MSG_TABLES, {});
  return decoded(answer(), bushd_decode_tables);
}

bushd_status Rig::arm(std::uint8_t number, bushd_edge edge, std::uint32_t delay_us,
                      const std::vector<bushd_table_run_entry>& entries) {
  return request(BUSHD_MSG_TRIGGER, payload_of([&](std::uint8_t* p) {
                   return bushd_encode_trigger(number, edge, delay_us, entries.data(),
                                               static_cast<std::uint8_t>(entries.size()), p);
                 }));
}

void Rig::emergency(bushd_stop_mode mode, std::uint8_t address) {
  frame(address, BUSHD_MSG_EMERGENCY, {static_cast<std::uint8_t>(mode)});
  EXPECT_FALSE(answer()) << "EMERGENCY is not answered";
}

void Rig::make_ready(const Law& law, bushd_format format, std::uint32_t tick) {
  EXPECT_EQ(configure(format), BUSHD_OK);
  sync_to(tick);
  EXPECT_EQ(upload(0, law), BUSHD_OK);
  for (std::uint8_t m = 0; m < options_.motors; ++m) EXPECT_EQ(assign(m, 0), BUSHD_OK);
  EXPECT_EQ(control(BUSHD_CONTROL_ENABLE), BUSHD_OK);
  EXPECT_EQ(poll().state, BUSHD_STATE_READY);
}

Bytes Rig::encode(Ticks ticks) const {
  if (format_ == BUSHD_FORMAT_FINE) ticks.flags |= BUSHD_TICKS_FINE;
  return ticks_payload(ticks);
}

bushd_status Rig::take(std::uint8_t type, const Bytes& payload) {
  const std::uint16_t before = poll().rejected_frames;
  frame(type, payload);
  EXPECT_FALSE(answer()) << "what moves motors is not answered";
  const bushd_report after = poll();
  if (after.rejected_frames == before) return BUSHD_OK;
  EXPECT_EQ(after.rejected_frames, before + 1);
  return static_cast<bushd_status>(after.last_rejection);
}

Ticks Rig::part(const Plan& plan, std::uint32_t start, std::size_t from, std::size_t count,
                std::uint8_t motor) const {
  const std::size_t end = std::min(from + count, plan.ticks());
  return {.flags = static_cast<std::uint8_t>(from == 0 ? BUSHD_TICKS_START : 0),
          .first = start + static_cast<std::uint32_t>(from),
          .count = static_cast<std::uint8_t>(end - from),
          .mask = static_cast<std::uint16_t>(1u << motor),
          .displacements = {plan.displacement.begin() + static_cast<std::ptrdiff_t>(from),
                            plan.displacement.begin() + static_cast<std::ptrdiff_t>(end)},
          .delays = {plan.delay[end - 1]},
          .epoch = mcu_.stream.epoch};
}

void Rig::run_plan(const Plan& plan, std::uint8_t motor) {
  constexpr std::size_t kPart = 10;
  const std::uint32_t start = first_open();
  for (std::size_t from = 0; from < plan.ticks(); from += kPart) {
    ASSERT_EQ(take(part(plan, start, from, kPart, motor)), BUSHD_OK) << "tick " << from;
    while (start + static_cast<std::uint32_t>(from) - tick() > 3) pass();
  }
  pass_until_rest();
}

int Rig::steps_of_plane(std::uint8_t m) const {
  if (slot_buffer_->outputs == BUSHD_OUTPUTS_LEVELS) return slot_buffer_->steps[m];
  int steps = 0;
  for (std::uint16_t slot = 0; slot < options_.slots; ++slot) {
    const bool common = slot_buffer_->outputs == BUSHD_OUTPUTS_COMMON_DIR;
    const bool right = common ? slot % 2 == 1 : (slot_buffer_->direction >> m & 1) != 0;
    if (slot_buffer_->step[slot] >> m & 1) steps += right ? 1 : -1;
  }
  return steps;
}

void Rig::pass() {
  for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
    const int steps = steps_of_plane(m);
    pulses_[m] += steps;
    history_[m].push_back(steps);
    if (steps != 0 && !enabled_) ++steps_while_disabled_;
  }
  if ((slot_buffer_->step[0] & (slot_buffer_->direction ^ direction_)) != 0) ++steps_with_dir_;
  direction_ = slot_buffer_->direction;
  slot_buffer_ = bushd_mcu_swap(&mcu_);
  bushd_mcu_prepare(&mcu_);
}

void Rig::pass_until_rest(int limit) {
  for (int i = 0; i < limit; ++i) {
    if (poll().moving == 0) return;
    pass();
  }
  ADD_FAILURE() << "does not come to rest";
}

void Rig::forget_history() {
  for (auto& ticks : history_) ticks.clear();
}

}  // namespace bushd::test

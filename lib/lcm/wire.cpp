#include "lcm/wire.h"

#include <fmt/format.h>

#include <algorithm>
#include <type_traits>

namespace bushd::lcm {
namespace {

// Walks over a payload, field by field in the order of the .lcm file; numbers are big-endian.
class Scan {
 public:
  explicit Scan(std::span<const std::uint8_t> payload) : rest_(payload) {}

  void fixed(std::size_t bytes) {
    if (bytes > rest_.size()) {
      good_ = false;
      rest_ = {};
    } else {
      rest_ = rest_.subspan(bytes);
    }
  }

  // Length with the NUL, characters, NUL.
  void text() {
    const std::size_t length = number();
    if (length == 0 || length > rest_.size()) {
      good_ = false;
      return;
    }
    const auto nul = std::find(rest_.begin(), rest_.end(), std::uint8_t{0});
    good_ = good_ && nul == rest_.begin() + static_cast<std::ptrdiff_t>(length - 1);
    fixed(length);
  }

  // An array length, of elements that take at least so many bytes; 0 once something is wrong.
  std::size_t count(std::size_t min_element_bytes) {
    const std::size_t elements = number();
    if (elements > rest_.size() / min_element_bytes) good_ = false;
    return good_ ? elements : 0;
  }

  bool ended_well() const { return good_ && rest_.empty(); }

 private:
  // An int32 seen as unsigned, so that a negative length is one that is far too long.
  std::size_t number() {
    if (rest_.size() < 4) {
      fixed(4);
      return 0;
    }
    const std::size_t value = std::size_t{rest_[0]} << 24 | std::size_t{rest_[1]} << 16 |
                              std::size_t{rest_[2]} << 8 | std::size_t{rest_[3]};
    fixed(4);
    return value;
  }

  std::span<const std::uint8_t> rest_;
  bool good_ = true;
};

constexpr std::size_t kFingerprint = 8;
constexpr std::size_t kInt8 = 1;
constexpr std::size_t kInt16 = 2;
constexpr std::size_t kInt32 = 4;
constexpr std::size_t kInt64 = 8;
constexpr std::size_t kDouble = 8;
constexpr std::size_t kMinText = 5;
constexpr std::size_t kMinTableRef = 2 * kMinText + kInt32;
constexpr std::size_t kMinMotorState =
    5 * kMinText + kMinTableRef + kInt16 + 2 * kInt64 + kDouble + 4 * kInt8;

void scan_fields(Scan& scan, std::type_identity<table_ref_t>) {
  scan.text();         // name
  scan.fixed(kInt32);  // revision
  scan.text();         // hash
}

void scan_fields(Scan& scan, std::type_identity<command_t>) {
  scan.fixed(kInt64);                  // utime_us
  scan.text();                         // client_id
  scan.fixed(kInt64);                  // number
  scan.fixed(kInt8);                   // kind
  scan.text();                         // group
  scan.text();                         // table
  scan.fixed(3 * kInt8 + 2 * kInt32);  // dry_run, edge, arrivals, delay_us, width_us
  const std::size_t motors = scan.count(kMinText + kInt64);
  for (std::size_t i = 0; i < motors; ++i) scan.text();
  scan.fixed(motors * kInt64);  // steps
}

constexpr std::size_t kMinPlanMotor = kMinText + 2 * kInt64 + kDouble;
constexpr std::size_t kMinPlan = 4 * kInt64 + kInt32;

void scan_fields(Scan& scan, std::type_identity<move_plan_t>) {
  scan.fixed(4 * kInt64);  // duration_us, ticks, frames, bytes
  const std::size_t motors = scan.count(kMinPlanMotor);
  for (std::size_t i = 0; i < motors; ++i) scan.text();
  scan.fixed(motors * (2 * kInt64 + kDouble));  // steps, motor_duration_us, peak_steps_per_s
}

void scan_fields(Scan& scan, std::type_identity<reply_t>) {
  scan.fixed(kInt64);  // utime_us
  scan.text();         // client_id
  scan.fixed(kInt64);  // number
  scan.fixed(kInt8);   // phase
  scan.text();         // result
  scan.text();         // reason
  const std::size_t motors = scan.count(2 * kMinText + kInt64 + kInt16);
  for (std::size_t i = 0; i < 2 * motors; ++i) scan.text();  // motors, motor_results
  scan.fixed(motors * (kInt64 + kInt16));                    // position_steps, table_of_motor
  const std::size_t tables = scan.count(kMinTableRef);
  for (std::size_t i = 0; i < tables; ++i) scan_fields(scan, std::type_identity<table_ref_t>{});
  const std::size_t plans = scan.count(kMinPlan);
  for (std::size_t i = 0; i < plans; ++i) scan_fields(scan, std::type_identity<move_plan_t>{});
}

constexpr std::size_t kMinTable = 3 * kMinText + 4 * kInt32 + kInt64;

void scan_fields(Scan& scan, std::type_identity<table_t>) {
  scan.text();                              // name
  scan.text();                              // description
  scan.fixed(kInt32);                       // revision
  scan.text();                              // hash
  scan.fixed(kInt64 + kInt32);              // time_unit_ns, cruise
  scan.fixed(scan.count(kInt32) * kInt32);  // accel
  scan.fixed(scan.count(kInt32) * kInt32);  // decel
}

constexpr std::size_t kMinTableEntry = 2 * kMinText + kMinTableRef + kInt32 + 2 * kDouble;

void scan_fields(Scan& scan, std::type_identity<table_entry_t>) {
  scan.text();  // name
  scan_fields(scan, std::type_identity<table_ref_t>{});
  scan.text();                       // fault
  scan.fixed(kInt32 + 2 * kDouble);  // codes, start_steps_per_s, max_steps_per_s
}

void scan_fields(Scan& scan, std::type_identity<table_request_t>) {
  scan.fixed(kInt64);  // utime_us
  scan.text();         // client_id
  scan.fixed(kInt64);  // number
  scan.fixed(kInt8);   // kind
  scan.text();         // table
  scan.text();         // expected_hash
  const std::size_t contents = scan.count(kMinTable);
  for (std::size_t i = 0; i < contents; ++i) scan_fields(scan, std::type_identity<table_t>{});
}

void scan_fields(Scan& scan, std::type_identity<table_reply_t>) {
  scan.fixed(kInt64);  // utime_us
  scan.text();         // client_id
  scan.fixed(kInt64);  // number
  scan.fixed(kInt8);   // done
  scan.text();         // reason
  const std::size_t entries = scan.count(kMinTableEntry);
  for (std::size_t i = 0; i < entries; ++i) scan_fields(scan, std::type_identity<table_entry_t>{});
  const std::size_t tables = scan.count(kMinTable);
  for (std::size_t i = 0; i < tables; ++i) scan_fields(scan, std::type_identity<table_t>{});
}

void scan_fields(Scan& scan, std::type_identity<motor_state_t>) {
  scan.text();  // name
  scan.text();  // group
  scan_fields(scan, std::type_identity<table_ref_t>{});
  scan.fixed(kInt16 + 2 * kInt64 + kDouble);  // output, position, target, velocity
  scan.fixed(kInt8);                          // moving
  scan.text();                                // activity
  scan.fixed(3 * kInt8);                      // armed, enabled, input
  scan.text();                                // forbidden
  scan.text();                                // trust
}

void scan_fields(Scan& scan, std::type_identity<state_t>) {
  scan.fixed(2 * kInt64 + 2 * kInt32);  // utime_us, sequence, part, parts
  scan.text();                          // bus
  scan.text();                          // mcu
  scan.fixed(kInt32);                   // address
  scan.text();                          // mcu_state
  scan.text();                          // detail
  scan.text();                          // inputs
  scan.fixed(kInt32 + 2 * kInt64);      // boot_number, tick, rejected_commands
  const std::size_t motors = scan.count(kMinMotorState);
  for (std::size_t i = 0; i < motors; ++i) scan_fields(scan, std::type_identity<motor_state_t>{});
}

constexpr std::size_t kMinMcuHealth = 3 * kMinText + 5 * kInt32 + 7 * kInt64 + 2 * kDouble + kInt8;

void scan_fields(Scan& scan, std::type_identity<mcu_health_t>) {
  scan.text();                      // mcu
  scan.fixed(kInt32);               // address
  scan.text();                      // unique_id
  scan.fixed(2 * kInt32);           // firmware_version, boot_number
  scan.text();                      // reset_cause
  scan.fixed(kInt32);               // current
  scan.fixed(7 * kInt64);           // crc_errors .. restarts
  scan.fixed(kInt32);               // low_water_ticks
  scan.fixed(2 * kDouble + kInt8);  // rate_ppm, clock_offset_us, two_masters
}

void scan_fields(Scan& scan, std::type_identity<health_t>) {
  scan.fixed(2 * kInt64 + 2 * kInt32);  // utime_us, sequence, part, parts
  scan.text();                          // bus
  scan.text();                          // port_state
  scan.fixed(kInt8 + 3 * kInt64);       // two_masters, crc_errors, stray_frames, recent_latency_us
  scan.fixed(scan.count(2 * kInt64) * 2 * kInt64);  // latency_below_us, latency_answers
  const std::size_t mcus = scan.count(kMinMcuHealth);
  for (std::size_t i = 0; i < mcus; ++i) scan_fields(scan, std::type_identity<mcu_health_t>{});
}

template <class T>
bool well_formed(std::span<const std::uint8_t> payload) {
  Scan scan(payload);
  scan.fixed(kFingerprint);  // compared by the decoder, before anything else
  scan_fields(scan, std::type_identity<T>{});
  return scan.ended_well();
}

bool counted(std::int32_t count, std::size_t elements) {
  return count >= 0 && static_cast<std::size_t>(count) == elements;
}

bool counts_match(const command_t& command) {
  return counted(command.motor_count, command.motors.size()) &&
         counted(command.motor_count, command.steps.size());
}

bool counts_match(const move_plan_t& plan) {
  return counted(plan.motor_count, plan.motors.size()) &&
         counted(plan.motor_count, plan.steps.size()) &&
         counted(plan.motor_count, plan.motor_duration_us.size()) &&
         counted(plan.motor_count, plan.peak_steps_per_s.size());
}

bool counts_match(const table_t& table) {
  return counted(table.accel_count, table.accel.size()) &&
         counted(table.decel_count, table.decel.size());
}

bool counts_match(const reply_t& reply) {
  return counted(reply.motor_count, reply.motors.size()) &&
         counted(reply.motor_count, reply.motor_results.size()) &&
         counted(reply.motor_count, reply.position_steps.size()) &&
         counted(reply.motor_count, reply.table_of_motor.size()) &&
         counted(reply.table_count, reply.tables.size()) &&
         counted(reply.plan_count, reply.plan.size()) &&
         std::ranges::all_of(reply.plan,
                             [](const move_plan_t& plan) { return counts_match(plan); });
}

bool counts_match(const table_request_t& request) {
  return counted(request.content_count, request.content.size()) &&
         std::ranges::all_of(request.content,
                             [](const table_t& table) { return counts_match(table); });
}

bool counts_match(const table_reply_t& reply) {
  return counted(reply.entry_count, reply.entries.size()) &&
         counted(reply.table_count, reply.tables.size()) &&
         std::ranges::all_of(reply.tables,
                             [](const table_t& table) { return counts_match(table); });
}

bool counts_match(const state_t& state) {
  return counted(state.motor_count, state.motors.size());
}

bool counts_match(const health_t& health) {
  return counted(health.latency_count, health.latency_below_us.size()) &&
         counted(health.latency_count, health.latency_answers.size()) &&
         counted(health.mcu_count, health.mcus.size());
}

}  // namespace

template <class T>
Result<std::vector<std::uint8_t>> encode(const T& message) {
  // The encoder reads as many elements as the counts say, however many there are.
  if (!counts_match(message)) {
    return fail(
        fmt::format("{}: a count, such as motor_count, is not the length of its arrays; set "
                    "it to that length",
                    T::getTypeName()));
  }
  const auto size = static_cast<std::size_t>(message.getEncodedSize());
  if (size > kMaxMessageBytes) {
    return fail(
        fmt::format("{} of {} bytes does not fit one datagram ({} bytes); name fewer motors, or "
                    "use a table of fewer codes",
                    T::getTypeName(), size, kMaxMessageBytes));
  }
  std::vector<std::uint8_t> bytes(size);
  const int used = message.encode(bytes.data(), 0, static_cast<int>(size));
  if (used < 0 || static_cast<std::size_t>(used) != size || !well_formed<T>(bytes)) {
    return fail(
        fmt::format("{}: one of its texts contains a NUL character; remove it", T::getTypeName()));
  }
  return bytes;
}

template <class T>
std::optional<T> decode(std::span<const std::uint8_t> payload) {
  if (payload.size() > kMaxMessageBytes || !well_formed<T>(payload)) return std::nullopt;
  T message{};
  const auto size = static_cast<int>(payload.size());
  if (message.decode(payload.data(), 0, size) != size) return std::nullopt;
  return message;
}

template Result<std::vector<std::uint8_t>> encode(const command_t&);
template Result<std::vector<std::uint8_t>> encode(const health_t&);
template Result<std::vector<std::uint8_t>> encode(const reply_t&);
template Result<std::vector<std::uint8_t>> encode(const state_t&);
template Result<std::vector<std::uint8_t>> encode(const table_reply_t&);
template Result<std::vector<std::uint8_t>> encode(const table_request_t&);
template std::optional<command_t> decode(std::span<const std::uint8_t>);
template std::optional<health_t> decode(std::span<const std::uint8_t>);
template std::optional<reply_t> decode(std::span<const std::uint8_t>);
template std::optional<state_t> decode(std::span<const std::uint8_t>);
template std::optional<table_reply_t> decode(std::span<const std::uint8_t>);
template std::optional<table_request_t> decode(std::span<const std::uint8_t>);

}  // namespace bushd::lcm

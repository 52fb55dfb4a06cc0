#include "lcm/wire.h"

#include <fmt/format.h>

#include <algorithm>

#include "lcm/layout.h"

namespace bushd::lcm {
namespace {

constexpr std::size_t kFingerprint = 8;

std::size_t size_of(char number) {
  switch (number) {
    case 'b':
    case 'B':
      return 1;
    case 'h':
    case 'H':
      return 2;
    case 'i':
    case 'I':
      return 4;
    default:
      return 8;
  }
}

// Walks over a payload, field by field; numbers are big-endian. Once something is wrong it stays
// so, and nothing is left to be walked over.
class Scan {
 public:
  explicit Scan(std::span<const std::uint8_t> payload) : rest_(payload) {}

  void fixed(std::size_t bytes) {
    if (bytes > rest_.size()) return fail_here();
    rest_ = rest_.subspan(bytes);
  }

  void walk(const Layout& layout) {
    std::size_t count = 0;
    auto nested = layout.nested.begin();
    for (const char field : layout.fields) {
      if (!good_) return;
      switch (field) {
        case 's':
          text();
          break;
        case 't':
          walk(**nested++);
          break;
        case 'n':
          count = number();
          break;
        case 'S':
          for (std::size_t i = 0; good_ && i < count; ++i) text();
          break;
        case 'T':
          for (std::size_t i = 0; good_ && i < count; ++i) walk(**nested);
          ++nested;
          break;
        default:  // Below 2^32 elements of up to 8 bytes: no overflow.
          fixed(field >= 'a' ? size_of(field) : count * size_of(field));
      }
    }
  }

  bool ended_well() const { return good_ && rest_.empty(); }

 private:
  void fail_here() {
    good_ = false;
    rest_ = {};
  }

  // Length with the NUL, characters, NUL.
  void text() {
    const std::size_t length = number();
    if (length == 0 || length > rest_.size()) return fail_here();
    const auto nul = std::find(rest_.begin(), rest_.end(), std::uint8_t{0});
    if (nul != rest_.begin() + static_cast<std::ptrdiff_t>(length - 1)) return fail_here();
    fixed(length);
  }

  // An int32 seen as unsigned, so that a negative length is one that is far too long.
  std::size_t number() {
    if (rest_.size() < 4) {
      fail_here();
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

template <class T>
bool well_formed(std::span<const std::uint8_t> payload) {
  Scan scan(payload);
  scan.fixed(kFingerprint);  // compared by the decoder, before anything else
  scan.walk(layout_of<T>());
  return scan.ended_well();
}

// Whether this count is the length of these arrays.
template <class... Array>
bool counted(std::int32_t count, const Array&... arrays) {
  return count >= 0 && ((static_cast<std::size_t>(count) == arrays.size()) && ...);
}

template <class T>
bool counts_match(const T& message);

template <class Element>
bool all_match(const std::vector<Element>& elements) {
  return std::ranges::all_of(elements,
                             [](const Element& element) { return counts_match(element); });
}

#define BUSHD_COUNTED(count, array)                 \
  if constexpr (requires { message.array.size(); }) \
    if (!counted(message.count, message.array)) return false

// One function for all types, by the names of their fields: a type of a new field is added here.
template <class T>
bool counts_match(const T& message) {
  BUSHD_COUNTED(motor_count, motors);
  BUSHD_COUNTED(motor_count, steps);
  BUSHD_COUNTED(motor_count, position_steps);
  BUSHD_COUNTED(motor_count, outcomes);
  BUSHD_COUNTED(motor_count, user_positions);
  BUSHD_COUNTED(motor_count, dial_positions);
  BUSHD_COUNTED(motor_count, units);
  BUSHD_COUNTED(motor_count, precisions);
  BUSHD_COUNTED(motor_count, table_of_motor);
  BUSHD_COUNTED(motor_count, motor_duration_us);
  BUSHD_COUNTED(motor_count, peak_steps_per_s);
  BUSHD_COUNTED(point_count, points_us);
  BUSHD_COUNTED(row_count, time_s);
  BUSHD_COUNTED(position_count, positions);
  BUSHD_COUNTED(speed_count, speeds);
  BUSHD_COUNTED(entry_count, entries);
  BUSHD_COUNTED(table_count, tables);
  BUSHD_COUNTED(content_count, content);
  BUSHD_COUNTED(plan_count, plan);
  BUSHD_COUNTED(accel_count, accel);
  BUSHD_COUNTED(decel_count, decel);
  BUSHD_COUNTED(latency_count, latency_below_us);
  BUSHD_COUNTED(latency_count, latency_answers);
  BUSHD_COUNTED(mcu_count, mcus);
  BUSHD_COUNTED(motion_count, motions);
  BUSHD_COUNTED(motor_count, asked_by);
  BUSHD_COUNTED(change_count, change_motors);
  BUSHD_COUNTED(change_count, change_keys);
  BUSHD_COUNTED(change_count, change_values);
  BUSHD_COUNTED(setting_count, setting_motors);
  BUSHD_COUNTED(setting_count, keys);
  BUSHD_COUNTED(setting_count, values);
  BUSHD_COUNTED(setting_count, values_in_file);
  // What is nested and has counts of its own.
  if constexpr (requires { message.plan.size(); }) return all_match(message.plan);
  if constexpr (requires { message.tables.front().accel; }) return all_match(message.tables);
  if constexpr (requires { message.content.size(); }) return all_match(message.content);
  if constexpr (requires { message.content.accel; }) return counts_match(message.content);
  return true;
}

#undef BUSHD_COUNTED

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

#define BUSHD_TRAVELS(type)                                       \
  template Result<std::vector<std::uint8_t>> encode(const type&); \
  template std::optional<type> decode(std::span<const std::uint8_t>);

BUSHD_TRAVELS(answer_t)
BUSHD_TRAVELS(arm_t)
BUSHD_TRAVELS(arm_line_t)
BUSHD_TRAVELS(camac_lam_t)
BUSHD_TRAVELS(camac_reply_t)
BUSHD_TRAVELS(camac_request_t)
BUSHD_TRAVELS(clear_faults_t)
BUSHD_TRAVELS(configuration_answer_t)
BUSHD_TRAVELS(configure_t)
BUSHD_TRAVELS(confirm_t)
BUSHD_TRAVELS(disable_t)
BUSHD_TRAVELS(disarm_t)
BUSHD_TRAVELS(emergency_stop_t)
BUSHD_TRAVELS(enable_t)
BUSHD_TRAVELS(get_history_t)
BUSHD_TRAVELS(get_status_t)
BUSHD_TRAVELS(get_table_t)
BUSHD_TRAVELS(health_t)
BUSHD_TRAVELS(hello_t)
BUSHD_TRAVELS(history_answer_t)
BUSHD_TRAVELS(hold_t)
BUSHD_TRAVELS(home_t)
BUSHD_TRAVELS(jog_t)
BUSHD_TRAVELS(list_tables_t)
BUSHD_TRAVELS(mcu_description_t)
BUSHD_TRAVELS(mcu_state_t)
BUSHD_TRAVELS(move_line_t)
BUSHD_TRAVELS(move_path_t)
BUSHD_TRAVELS(follow_t)
BUSHD_TRAVELS(move_t)
BUSHD_TRAVELS(pause_t)
BUSHD_TRAVELS(position_compare_t)
BUSHD_TRAVELS(release_t)
BUSHD_TRAVELS(reload_tables_t)
BUSHD_TRAVELS(resume_t)
BUSHD_TRAVELS(set_position_t)
BUSHD_TRAVELS(set_table_t)
BUSHD_TRAVELS(stop_t)
BUSHD_TRAVELS(subscribe_t)
BUSHD_TRAVELS(table_answer_t)
BUSHD_TRAVELS(use_table_t)
BUSHD_TRAVELS(welcome_t)

#undef BUSHD_TRAVELS

}  // namespace bushd::lcm

// What clients say.
#include <algorithm>
#include <array>
#include <type_traits>

#include "lcm/camac_codec.h"
#include "lcm/codec.h"
#include "lcm/packet.h"
#include "lcm/table_codec.h"
#include "lcm/wire.h"

namespace bushd::lcm {
namespace {

RequestId id_of(const request_t& request) {
  return {.session = request.session, .client_id = request.client_id, .number = request.number};
}

motor_amount_t amount_message(const api::MotorAmount& motor) {
  motor_amount_t message{};
  message.motor = motor.motor;
  if (const auto* steps = std::get_if<std::int64_t>(&motor.amount)) {
    message.in_steps = 1;
    message.steps = *steps;
  } else {
    message.user = std::get<api::UserUnits>(motor.amount).value;
  }
  return message;
}

api::MotorAmount amount_of(const motor_amount_t& message) {
  if (message.in_steps != 0) return {message.motor, message.steps};
  return {message.motor, api::UserUnits{message.user}};
}

std::vector<api::MotorAmount> amounts_of(const std::vector<motor_amount_t>& motors) {
  std::vector<api::MotorAmount> out;
  out.reserve(motors.size());
  for (const motor_amount_t& motor : motors) out.push_back(amount_of(motor));
  return out;
}

void put_motors(auto& message, const std::vector<api::MotorAmount>& motors) {
  for (const api::MotorAmount& motor : motors) message.motors.push_back(amount_message(motor));
  message.motor_count = count(motors);
}

void put_motors(auto& message, const api::MotorNames& motors) {
  message.motors = motors;
  message.motor_count = count(motors);
}

void put_speed(auto& message, const std::optional<api::Speed>& speed) {
  message.speed = speed ? speed->per_s : 0.0;
  message.speed_in_steps = speed && speed->in_steps ? 1 : 0;
}

std::optional<api::Speed> speed_of(const auto& message) {
  if (message.speed == 0) return std::nullopt;
  return api::Speed{.per_s = message.speed, .in_steps = message.speed_in_steps != 0};
}

// One of these per request: to the message, and back.
move_t to_message(const api::Move& move) {
  move_t message{};
  message.kind = move.kind == api::Move::Kind::kAbsolute ? move_t::ABSOLUTE : move_t::RELATIVE;
  message.dry_run = move.dry_run ? 1 : 0;
  put_speed(message, move.speed);
  put_motors(message, move.motors);
  return message;
}
std::optional<api::Request> from_message(const move_t& message) {
  if (message.kind != move_t::RELATIVE && message.kind != move_t::ABSOLUTE) return std::nullopt;
  return api::Move{.kind = message.kind == move_t::ABSOLUTE ? api::Move::Kind::kAbsolute
                                                            : api::Move::Kind::kRelative,
                   .motors = amounts_of(message.motors),
                   .dry_run = message.dry_run != 0,
                   .speed = speed_of(message)};
}

move_line_t to_message(const api::MoveLine& move) {
  move_line_t message{};
  message.kind =
      move.kind == api::Move::Kind::kAbsolute ? move_line_t::ABSOLUTE : move_line_t::RELATIVE;
  message.dry_run = move.dry_run ? 1 : 0;
  put_speed(message, move.speed);
  message.duration_s = move.duration_s.value_or(0.0);
  put_motors(message, move.motors);
  return message;
}
std::optional<api::Request> from_message(const move_line_t& message) {
  if (message.kind != move_line_t::RELATIVE && message.kind != move_line_t::ABSOLUTE) {
    return std::nullopt;
  }
  api::MoveLine move{.kind = message.kind == move_line_t::ABSOLUTE ? api::Move::Kind::kAbsolute
                                                                   : api::Move::Kind::kRelative,
                     .motors = amounts_of(message.motors),
                     .dry_run = message.dry_run != 0,
                     .speed = speed_of(message)};
  if (message.duration_s != 0) move.duration_s = message.duration_s;
  return move;
}

move_path_t to_message(const api::MovePath& path) {
  move_path_t message{};
  message.rows = path.rows;
  message.first_row = path.first_row;
  message.corners =
      path.corners == api::MovePath::Corners::kExact ? move_path_t::EXACT : move_path_t::CONTINUOUS;
  message.dry_run = path.dry_run ? 1 : 0;
  put_speed(message, path.speed);
  put_motors(message, path.motors);
  message.positions = path.positions;
  message.position_count = count(path.positions);
  message.speeds = path.speeds;
  message.speed_count = count(path.speeds);
  return message;
}
std::optional<api::Request> from_message(const move_path_t& message) {
  if (message.corners != move_path_t::CONTINUOUS && message.corners != move_path_t::EXACT) {
    return std::nullopt;
  }
  return api::MovePath{.motors = message.motors,
                       .rows = message.rows,
                       .first_row = message.first_row,
                       .positions = message.positions,
                       .speeds = message.speeds,
                       .corners = message.corners == move_path_t::EXACT
                                      ? api::MovePath::Corners::kExact
                                      : api::MovePath::Corners::kContinuous,
                       .dry_run = message.dry_run != 0,
                       .speed = speed_of(message)};
}

template <class Message>
Message motors_message(const api::MotorNames& motors) {
  Message message{};
  put_motors(message, motors);
  return message;
}
stop_t to_message(const api::Stop& stop) {
  return motors_message<stop_t>(stop.motors);
}
std::optional<api::Request> from_message(const stop_t& message) {
  return api::Stop{message.motors};
}
enable_t to_message(const api::Enable& enable) {
  return motors_message<enable_t>(enable.motors);
}
std::optional<api::Request> from_message(const enable_t& message) {
  return api::Enable{message.motors};
}
disable_t to_message(const api::Disable& disable) {
  return motors_message<disable_t>(disable.motors);
}
std::optional<api::Request> from_message(const disable_t& message) {
  return api::Disable{message.motors};
}
clear_faults_t to_message(const api::ClearFaults& clear) {
  return motors_message<clear_faults_t>(clear.motors);
}
std::optional<api::Request> from_message(const clear_faults_t& message) {
  return api::ClearFaults{message.motors};
}
home_t to_message(const api::Home& home) {
  auto message = motors_message<home_t>(home.motors);
  put_speed(message, home.speed);
  message.all = home.all ? 1 : 0;
  return message;
}
std::optional<api::Request> from_message(const home_t& message) {
  return api::Home{.motors = message.motors, .speed = speed_of(message), .all = message.all != 0};
}
disarm_t to_message(const api::Disarm& disarm) {
  return motors_message<disarm_t>(disarm.motors);
}
std::optional<api::Request> from_message(const disarm_t& message) {
  return api::Disarm{message.motors};
}

emergency_stop_t to_message(const api::EmergencyStop&) {
  return {};
}
std::optional<api::Request> from_message(const emergency_stop_t&) {
  return api::EmergencyStop{};
}

set_position_t to_message(const api::SetPosition& set) {
  set_position_t message{};
  message.dial = set.dial ? 1 : 0;
  put_motors(message, set.motors);
  return message;
}
std::optional<api::Request> from_message(const set_position_t& message) {
  return api::SetPosition{.motors = amounts_of(message.motors), .dial = message.dial != 0};
}

use_table_t to_message(const api::UseTable& use) {
  use_table_t message{};
  message.group = use.group;
  message.table = use.table;
  return message;
}
std::optional<api::Request> from_message(const use_table_t& message) {
  return api::UseTable{.group = message.group, .table = message.table};
}
reload_tables_t to_message(const api::ReloadTables&) {
  return {};
}
std::optional<api::Request> from_message(const reload_tables_t&) {
  return api::ReloadTables{};
}

arm_t to_message(const api::Arm& arm) {
  arm_t message{};
  message.edge = arm.edge == api::Edge::kRising ? arm_t::RISING : arm_t::FALLING;
  message.delay_us = arm.delay_us;
  message.while_connected = arm.while_connected ? 1 : 0;
  put_speed(message, arm.speed);
  put_motors(message, arm.motors);
  return message;
}
std::optional<api::Request> from_message(const arm_t& message) {
  if (message.edge != arm_t::RISING && message.edge != arm_t::FALLING) return std::nullopt;
  return api::Arm{.edge = message.edge == arm_t::RISING ? api::Edge::kRising : api::Edge::kFalling,
                  .delay_us = message.delay_us,
                  .motors = amounts_of(message.motors),
                  .speed = speed_of(message),
                  .while_connected = message.while_connected != 0};
}

arm_line_t to_message(const api::ArmLine& arm) {
  arm_line_t message{};
  message.edge = arm.edge == api::Edge::kRising ? arm_line_t::RISING : arm_line_t::FALLING;
  message.delay_us = arm.delay_us;
  message.kind =
      arm.kind == api::Move::Kind::kAbsolute ? arm_line_t::ABSOLUTE : arm_line_t::RELATIVE;
  put_speed(message, arm.speed);
  message.duration_s = arm.duration_s.value_or(0.0);
  message.while_connected = arm.while_connected ? 1 : 0;
  put_motors(message, arm.motors);
  return message;
}
std::optional<api::Request> from_message(const arm_line_t& message) {
  if (message.edge != arm_line_t::RISING && message.edge != arm_line_t::FALLING) {
    return std::nullopt;
  }
  if (message.kind != arm_line_t::RELATIVE && message.kind != arm_line_t::ABSOLUTE) {
    return std::nullopt;
  }
  api::ArmLine arm{
      .edge = message.edge == arm_line_t::RISING ? api::Edge::kRising : api::Edge::kFalling,
      .delay_us = message.delay_us,
      .kind = message.kind == arm_line_t::ABSOLUTE ? api::Move::Kind::kAbsolute
                                                   : api::Move::Kind::kRelative,
      .motors = amounts_of(message.motors),
      .speed = speed_of(message)};
  if (message.duration_s != 0) arm.duration_s = message.duration_s;
  arm.while_connected = message.while_connected != 0;
  return arm;
}

position_compare_t to_message(const api::PositionCompare& compare) {
  position_compare_t message{};
  message.position = amount_message({compare.motor, compare.position});
  message.arrivals =
      static_cast<std::int8_t>((compare.arrivals.positive ? position_compare_t::POSITIVE : 0) |
                               (compare.arrivals.negative ? position_compare_t::NEGATIVE : 0));
  message.delay_us = compare.delay_us;
  message.width_us = compare.width_us;
  return message;
}
std::optional<api::Request> from_message(const position_compare_t& message) {
  constexpr int kBoth = position_compare_t::POSITIVE | position_compare_t::NEGATIVE;
  if ((message.arrivals & ~kBoth) != 0) return std::nullopt;
  return api::PositionCompare{
      .motor = message.position.motor,
      .position = amount_of(message.position).amount,
      .arrivals = {.positive = (message.arrivals & position_compare_t::POSITIVE) != 0,
                   .negative = (message.arrivals & position_compare_t::NEGATIVE) != 0},
      .delay_us = message.delay_us,
      .width_us = message.width_us};
}

list_tables_t to_message(const api::ListTables&) {
  return {};
}
std::optional<api::Request> from_message(const list_tables_t&) {
  return api::ListTables{};
}
get_table_t to_message(const api::GetTable& get) {
  get_table_t message{};
  message.table = get.table;
  return message;
}
std::optional<api::Request> from_message(const get_table_t& message) {
  return api::GetTable{message.table};
}
set_table_t to_message(const api::SetTable& set) {
  set_table_t message{};
  message.table = set.table;
  message.expected_hash = set.expected_hash;
  message.content = message_of(set.content);
  return message;
}
std::optional<api::Request> from_message(const set_table_t& message) {
  return api::SetTable{.table = message.table,
                       .content = content_of(message.content),
                       .expected_hash = message.expected_hash};
}

confirm_t to_message(const api::Confirm& confirm) {
  return motors_message<confirm_t>(confirm.motors);
}
std::optional<api::Request> from_message(const confirm_t& message) {
  return api::Confirm{message.motors};
}
get_history_t to_message(const api::GetHistory& get) {
  get_history_t message{};
  message.motor = get.motor;
  message.most = get.most;
  return message;
}
std::optional<api::Request> from_message(const get_history_t& message) {
  return api::GetHistory{.motor = message.motor, .most = message.most};
}

configure_t to_message(const api::Configure& configure) {
  using Kind = api::Configure::Kind;
  auto message = motors_message<configure_t>(configure.motors);
  message.kind = configure.kind == Kind::kShow     ? configure_t::SHOW
                 : configure.kind == Kind::kChange ? configure_t::CHANGE
                                                   : configure_t::SAVED;
  for (const auto& [motor, key, value] : configure.changes) {
    message.change_motors.push_back(motor);
    message.change_keys.push_back(key);
    message.change_values.push_back(value);
  }
  message.change_count = count(configure.changes);
  message.file_sha256 = configure.file_sha256;
  return message;
}
std::optional<api::Request> from_message(const configure_t& message) {
  using Kind = api::Configure::Kind;
  if (message.kind < configure_t::SHOW || message.kind > configure_t::SAVED) return std::nullopt;
  api::Configure configure{.kind = message.kind == configure_t::SHOW     ? Kind::kShow
                                   : message.kind == configure_t::CHANGE ? Kind::kChange
                                                                         : Kind::kSaved,
                           .motors = message.motors,
                           .file_sha256 = message.file_sha256};
  for (std::size_t i = 0; i < message.change_motors.size(); ++i) {
    configure.changes.push_back(
        {message.change_motors[i], message.change_keys[i], message.change_values[i]});
  }
  return configure;
}

jog_t to_message(const api::Jog& jog) {
  jog_t message{};
  message.motor = jog.motor;
  message.speed = jog.per_s;
  message.speed_in_steps = jog.in_steps ? 1 : 0;
  message.keepalive_ms = jog.keepalive_ms;
  message.renew = jog.renew ? 1 : 0;
  message.steps_after = jog.steps_after.value_or(-1);
  return message;
}
std::optional<api::Request> from_message(const jog_t& message) {
  api::Jog jog{.motor = message.motor,
               .per_s = message.speed,
               .in_steps = message.speed_in_steps != 0,
               .keepalive_ms = message.keepalive_ms,
               .renew = message.renew != 0};
  if (message.steps_after != -1) jog.steps_after = message.steps_after;
  return jog;
}

pause_t to_message(const api::Pause& pause) {
  return motors_message<pause_t>(pause.motors);
}
std::optional<api::Request> from_message(const pause_t& message) {
  return api::Pause{message.motors};
}
resume_t to_message(const api::Resume& resume) {
  return motors_message<resume_t>(resume.motors);
}
std::optional<api::Request> from_message(const resume_t& message) {
  return api::Resume{message.motors};
}
hold_t to_message(const api::Hold& hold) {
  return motors_message<hold_t>(hold.motors);
}
std::optional<api::Request> from_message(const hold_t& message) {
  return api::Hold{message.motors};
}
release_t to_message(const api::Release& release) {
  return motors_message<release_t>(release.motors);
}
std::optional<api::Request> from_message(const release_t& message) {
  return api::Release{message.motors};
}

follow_t to_message(const api::Follow& follow) {
  auto message = motors_message<follow_t>(follow.motors);
  message.part = follow.part == api::Follow::Part::kRows       ? follow_t::ROWS
                 : follow.part == api::Follow::Part::kLastRows ? follow_t::LAST_ROWS
                                                               : follow_t::RUN;
  message.array = follow.array;
  message.cubic = follow.cubic ? 1 : 0;
  message.stretch = follow.stretch;
  message.time_s = follow.time_s;
  message.row_count = count(follow.time_s);
  message.positions = follow.positions;
  message.position_count = count(follow.positions);
  return message;
}
std::optional<api::Request> from_message(const follow_t& message) {
  using Part = api::Follow::Part;
  if (message.part < follow_t::ROWS || message.part > follow_t::RUN) return std::nullopt;
  return api::Follow{.part = message.part == follow_t::ROWS        ? Part::kRows
                             : message.part == follow_t::LAST_ROWS ? Part::kLastRows
                                                                   : Part::kRun,
                     .array = message.array,
                     .motors = message.motors,
                     .cubic = message.cubic != 0,
                     .stretch = message.stretch,
                     .time_s = message.time_s,
                     .positions = message.positions};
}

std::optional<api::Request> from_message(const camac_request_t& message) {
  auto camac = camac_of(message);
  if (!camac) return std::nullopt;
  return *std::move(camac);
}

template <class Message>
std::optional<ClientMessage> decode_request(Payload payload) {
  const auto message = decode<Message>(payload);
  if (!message) return std::nullopt;
  auto request = from_message(*message);
  if (!request) return std::nullopt;
  return ClientMessage{.id = id_of(message->request),
                       .utime_us = message->request.utime_us,
                       .content = std::move(*request)};
}

std::optional<ClientMessage> decode_hello(Payload payload) {
  const auto message = decode<hello_t>(payload);
  if (!message) return std::nullopt;
  return ClientMessage{.id = {.client_id = message->client_id},
                       .content = Hello{message->client_id, message->nonce}};
}

std::optional<ClientMessage> decode_subscription(Payload payload) {
  const auto message = decode<subscribe_t>(payload);
  if (!message) return std::nullopt;
  return ClientMessage{.id = {},
                       .content = Subscription{.state = message->state != 0,
                                               .description = message->description != 0,
                                               .health = message->health != 0}};
}

std::optional<ClientMessage> decode_get_status(Payload payload) {
  const auto message = decode<get_status_t>(payload);
  if (!message) return std::nullopt;
  return ClientMessage{.id = id_of(message->request), .content = GetStatus{}};
}

using RequestDecoder = std::optional<ClientMessage> (*)(Payload);

// A new request is a line here. Requests first, in the order of api::Request.
constexpr std::size_t kRequests = std::variant_size_v<api::Request::variant>;
constexpr std::array<std::pair<std::string_view, RequestDecoder>, kRequests + 3> kRequestDecoders =
    {{
        {"MOVE", decode_request<move_t>},
        {"STOP", decode_request<stop_t>},
        {"EMERGENCY_STOP", decode_request<emergency_stop_t>},
        {"ENABLE", decode_request<enable_t>},
        {"DISABLE", decode_request<disable_t>},
        {"SET_POSITION", decode_request<set_position_t>},
        {"CLEAR_FAULTS", decode_request<clear_faults_t>},
        {"USE_TABLE", decode_request<use_table_t>},
        {"RELOAD_TABLES", decode_request<reload_tables_t>},
        {"HOME", decode_request<home_t>},
        {"ARM", decode_request<arm_t>},
        {"DISARM", decode_request<disarm_t>},
        {"POSITION_COMPARE", decode_request<position_compare_t>},
        {"LIST_TABLES", decode_request<list_tables_t>},
        {"GET_TABLE", decode_request<get_table_t>},
        {"SET_TABLE", decode_request<set_table_t>},
        {"CONFIRM", decode_request<confirm_t>},
        {"GET_HISTORY", decode_request<get_history_t>},
        {"CONFIGURE", decode_request<configure_t>},
        {"JOG", decode_request<jog_t>},
        {"PAUSE", decode_request<pause_t>},
        {"RESUME", decode_request<resume_t>},
        {"HOLD", decode_request<hold_t>},
        {"RELEASE", decode_request<release_t>},
        {"MOVE_LINE", decode_request<move_line_t>},
        {"CAMAC", decode_request<camac_request_t>},
        {"MOVE_PATH", decode_request<move_path_t>},
        {"FOLLOW", decode_request<follow_t>},
        {"ARM_LINE", decode_request<arm_line_t>},
        {"HELLO", decode_hello},
        {"SUBSCRIBE", decode_subscription},
        {"GET_STATUS", decode_get_status},
    }};
static_assert(kRequestDecoders.back().second != nullptr);

constexpr auto kClientChannels = [] {
  std::array<std::string_view, kRequestDecoders.size()> channels;
  for (std::size_t i = 0; i < channels.size(); ++i) channels[i] = kRequestDecoders[i].first;
  return channels;
}();

void put_id(request_t& request, std::int64_t utime_us, const RequestId& id) {
  request.utime_us = utime_us;
  request.session = id.session;
  request.client_id = id.client_id;
  request.number = id.number;
}

}  // namespace

std::span<const std::string_view> client_channels() {
  return kClientChannels;
}

std::span<const std::string_view> urgent_channels() {
  static constexpr std::array<std::string_view, 6> kChannels = {"STOP", "EMERGENCY_STOP", "PAUSE",
                                                                "HOLD", "DISARM",         "JOG"};
  return kChannels;
}

bool is_urgent_channel(std::string_view channel) {
  return std::ranges::find(urgent_channels(), channel) != urgent_channels().end();
}

std::optional<ClientMessage> decode_client_message(std::string_view channel, Payload payload) {
  for (const auto& [name, decoder] : kRequestDecoders) {
    if (name == channel) return decoder(payload);
  }
  return std::nullopt;
}

bushd::Result<Packet> encode(std::int64_t utime_us, const RequestId& id,
                             const api::Request& request) {
  return std::visit(
      [&](const auto& content) {
        auto message = to_message(content);
        put_id(message.request, utime_us, id);
        return packet(kRequestDecoders[request.index()].first, message);
      },
      request);
}

bushd::Result<Packet> encode(std::int64_t utime_us, const RequestId& id, GetStatus) {
  get_status_t message{};
  put_id(message.request, utime_us, id);
  return packet("GET_STATUS", message);
}

bushd::Result<Packet> encode(std::int64_t utime_us, const Hello& hello) {
  hello_t message{};
  message.utime_us = utime_us;
  message.client_id = hello.client_id;
  message.nonce = hello.nonce;
  return packet("HELLO", message);
}

bushd::Result<Packet> encode(const Subscription& subscription) {
  subscribe_t message{};
  message.state = subscription.state ? 1 : 0;
  message.description = subscription.description ? 1 : 0;
  message.health = subscription.health ? 1 : 0;
  return packet("SUBSCRIBE", message);
}

}  // namespace bushd::lcm

#include "bus/rs485/program_link.h"

#include <algorithm>
#include <utility>

#include "engine/program.h"

namespace bushd::link {
namespace {

constexpr std::int64_t kStatePeriodUs = 200'000;
// A stop that was not answered waits for its turn before it is urgent again: an MCU that has gone
// must not keep others from being stopped.
constexpr std::int64_t kUrgentAgainUs = 100'000;

constexpr std::uint32_t bit(bushd_program_action action) {
  return std::uint32_t{1} << action;
}
constexpr std::uint32_t kBeginMotion = bit(BUSHD_PROGRAM_RUN) | bit(BUSHD_PROGRAM_RESUME);

bool is_kept(std::uint8_t flags) {
  return (flags & BUSHD_PROGRAM_KEPT) != 0;
}

Request control(bushd_program_action action, std::uint8_t number, std::uint32_t value) {
  return request_of(bushd_program_control{
      .action = static_cast<std::uint8_t>(action), .number = number, .value = value});
}

}  // namespace

void ProgramLink::put(std::vector<std::uint8_t> bytes) {
  upload_.clear();
  upload_serial_ = ++serial_;
  view_.put = 0;
  view_.total = bytes.size();
  view_.uploading = true;
  view_.refused = BUSHD_OK;
  storing_ = is_kept(view_.state.flags) || (bytes.size() > 1 && is_kept(bytes[1]));
  if (bytes.empty() || bytes.size() > UINT16_MAX) return end_upload(BUSHD_E_CAPACITY);
  for (std::size_t at = 0; at < bytes.size(); at += BUSHD_PROGRAM_PUT_MAX) {
    const auto count =
        static_cast<std::uint8_t>(std::min<std::size_t>(bytes.size() - at, BUSHD_PROGRAM_PUT_MAX));
    const bushd_program_put part = {.offset = static_cast<std::uint16_t>(at),
                                    .total = static_cast<std::uint16_t>(bytes.size()),
                                    .count = count,
                                    .bytes = bytes.data() + at};
    upload_.push_back(request_of(part));
  }
  const std::uint32_t crc = ~bushd_crc32(BUSHD_CRC32_START, bytes.data(), bytes.size());
  upload_.push_back(control(BUSHD_PROGRAM_COMMIT, 0, crc));
}

void ProgramLink::end_upload(std::uint8_t status) {
  upload_.clear();
  view_.uploading = false;
  view_.refused = status;
  wanted_ = true;
}

void ProgramLink::order(bushd_program_action action, std::uint8_t number, std::uint32_t value,
                        Tick start) {
  orders_.push_back({.action = action,
                     .start = start,
                     .serial = ++serial_,
                     .request = control(action, number, value)});
}

void ProgramLink::discard(std::uint32_t actions) {
  std::erase_if(orders_, [&](const Order& one) { return (actions & bit(one.action)) != 0; });
}

void ProgramLink::erase() {
  if (view_.uploading) end_upload(BUSHD_OK);
  view_.put = view_.total = 0;
  storing_ = is_kept(view_.state.flags);
  order(BUSHD_PROGRAM_ERASE, 0, 0);
}

void ProgramLink::run(std::uint8_t number, Tick start) {
  order(BUSHD_PROGRAM_RUN, number, static_cast<std::uint32_t>(start), start);
}

void ProgramLink::stop(bushd_stop_mode mode) {
  orders_.clear();
  urgent_from_us_ = 0;
  order(BUSHD_PROGRAM_STOP, 0, mode);
}

// One that waits for its first tick is not paused: the MCU refuses that.
void ProgramLink::pause() {
  discard(bit(BUSHD_PROGRAM_RESUME));
  urgent_from_us_ = 0;
  order(BUSHD_PROGRAM_PAUSE, 0, 0);
}

void ProgramLink::resume() {
  order(BUSHD_PROGRAM_RESUME, 0, 0);
}

void ProgramLink::discard_motion() {
  discard(kBeginMotion);
}

// The MCU may have taken it all the same.
bool ProgramLink::end_late_run(Tick now, Tick margin) {
  const bool late = std::ranges::any_of(orders_, [&](const Order& one) {
    return one.action == BUSHD_PROGRAM_RUN && now + margin >= one.start;
  });
  if (late) stop(BUSHD_STOP_RAMP);
  return late;
}

bool ProgramLink::takes_motion_away() const {
  if (orders_.empty()) return false;
  const bushd_program_action next = orders_.front().action;
  return next == BUSHD_PROGRAM_STOP || next == BUSHD_PROGRAM_PAUSE;
}

std::int64_t ProgramLink::due_us() const {
  if (wanted_) return 0;
  const bool news = view_.known && (view_.under_way() || storing_);
  return news ? view_.heard_us + kStatePeriodUs : INT64_MAX;
}

const Request& ProgramLink::ask(std::int64_t now_us) {
  if (orders_.empty()) {
    asked_ = 0;
    return question_;
  }
  if (takes_motion_away()) urgent_from_us_ = now_us + kUrgentAgainUs;
  asked_ = orders_.front().serial;
  return orders_.front().request;
}

const Request& ProgramLink::ask_part() {
  asked_ = upload_serial_;
  return upload_.front();
}

ProgramLink::Answer ProgramLink::acknowledged(std::uint8_t type, std::uint8_t status) {
  if (type == BUSHD_MSG_PROGRAM_STATE) {
    denied_ = true;
    wanted_ = false;
    view_.known = false;
    return Answer::kNone;
  }
  const std::uint32_t asked = std::exchange(asked_, 0);
  if (asked == 0) return Answer::kNone;
  if (!orders_.empty() && orders_.front().serial == asked) {
    orders_.pop_front();
    wanted_ = true;
    return status == BUSHD_OK ? Answer::kTaken : Answer::kRefused;
  }
  if (upload_.empty() || asked != upload_serial_ || upload_.front().type != type) {
    return Answer::kNone;
  }
  if (status != BUSHD_OK) {
    end_upload(status);
    return Answer::kOfUpload;
  }
  upload_.pop_front();
  view_.put = std::min(view_.put + BUSHD_PROGRAM_PUT_MAX, view_.total);
  if (upload_.empty()) end_upload(BUSHD_OK);
  return Answer::kOfUpload;
}

void ProgramLink::told(std::int64_t now_us, const bushd_program_state& state) {
  view_.known = true;
  view_.state = state;
  view_.heard_us = now_us;
  wanted_ = false;
  const bool all_done = !view_.uploading && orders_.empty();
  if (all_done && (state.flags & BUSHD_PROGRAM_STORED) != 0) storing_ = false;
}

}  // namespace bushd::link

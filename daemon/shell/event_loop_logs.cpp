// What the loop writes down: its log, and that of moves.
#include <nlohmann/json.hpp>

#include "base/json_text.h"
#include "base/printable.h"
#include "daemon/core/request_log.h"
#include "daemon/shell/event_loop.h"
#include "daemon/shell/process.h"
#include "daemon/shell/service_manager.h"

namespace bushd::daemon {

void EventLoop::move_log(const std::string& json_line) {
  if (move_log_ != nullptr) move_log_->append(json_line);
}

// Anybody may stop, as often as he likes and by any name: no session is needed.
api::Asker EventLoop::with_log(const api::Asker& asker, const api::Request& request) {
  const bool too_many =
      api::ends_motion(request) && !stop_limit_.take(now_us(), std::string(api::name_of(request)));
  return too_many ? asker : logged(asker, request, *this);
}

void EventLoop::tell_left_out(std::int64_t now) {
  for (const LogLimit::LeftOut& left_out : log_limit_.due(now)) {
    write_log(LogLevel::kWarning, left_out.text());
  }
  for (const LogLimit::LeftOut& left_out : stop_limit_.due(now)) {
    const nlohmann::json line = {{"event", "requests"},
                                 {"utime_us", wall_clock_us()},
                                 {"request", left_out.newest},
                                 {"left_out", left_out.lines}};
    move_log(json_text(line));
  }
}

void EventLoop::log(LogLevel level, LogSubject subject, const std::string& text) {
  const auto line = log_limit_.take(now_us(), printable(text));
  if (!line) return;
  JournalFields fields;
  if (const auto* motor = std::get_if<MotorId>(&subject)) {
    fields.motor = config_[*motor].name;
    subject = config_[*motor].mcu;
  }
  if (const auto* mcu = std::get_if<McuId>(&subject)) fields.mcu = config_[*mcu].id;
  write_log(level, *line, fields);
}

}  // namespace bushd::daemon

#include "daemon/service_manager.h"

#include <fmt/format.h>
#include <spdlog/sinks/systemd_sink.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <systemd/sd-daemon.h>
#include <systemd/sd-journal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <memory>

namespace bushd::daemon {
namespace {

bool journal_used = false;

// $JOURNAL_STREAM is DEVICE:INODE of the stream; standard error may have been redirected since.
bool is_journal(int fd) {
  const char* stream = std::getenv("JOURNAL_STREAM");
  struct stat status{};
  if (stream == nullptr || ::fstat(fd, &status) != 0) return false;
  return std::to_string(status.st_dev) + ":" + std::to_string(status.st_ino) == stream;
}

spdlog::level::level_enum level_of(LogLevel level) {
  switch (level) {
    case LogLevel::kInfo:
      return spdlog::level::info;
    case LogLevel::kWarning:
      return spdlog::level::warn;
    case LogLevel::kError:
      return spdlog::level::err;
  }
  return spdlog::level::err;
}

// As in syslog(3).
int priority_of(LogLevel level) {
  constexpr std::array kPriorities{6, 4, 3};
  return kPriorities[static_cast<std::size_t>(level)];
}

iovec field(std::string& text) {
  return {.iov_base = text.data(), .iov_len = text.size()};
}

}  // namespace

void use_journal() {
  if (!is_journal(STDERR_FILENO)) return;
  journal_used = true;
  auto logger =
      std::make_shared<spdlog::logger>("bushd", std::make_shared<spdlog::sinks::systemd_sink_mt>());
  spdlog::set_default_logger(std::move(logger));
}

void write_log(LogLevel level, const std::string& text, const JournalFields& fields) {
  if (!journal_used || (fields.motor.empty() && fields.mcu.empty())) {
    return spdlog::log(level_of(level), "{}", text);
  }
  std::array<std::string, 5> lines{
      "MESSAGE=" + text, "PRIORITY=" + std::to_string(priority_of(level)),
      "SYSLOG_IDENTIFIER=bushd", "MCU=" + fields.mcu, "MOTOR=" + fields.motor};
  std::array<iovec, lines.size()> parts{};
  for (std::size_t i = 0; i < lines.size(); ++i) parts[i] = field(lines[i]);
  // A motor's line is one of its MCU too; not the other way round.
  static_cast<void>(sd_journal_sendv(parts.data(), fields.motor.empty() ? 4 : 5));
}

void tell_ready() {
  static_cast<void>(sd_notify(0, "READY=1"));
}

void tell_stopping() {
  static_cast<void>(sd_notify(0, "STOPPING=1"));
}

std::string status_text(const config::Config& config, const ById<McuId, api::McuState>& mcus) {
  const auto counted = [](std::size_t count, const char* one, const char* many) {
    return fmt::format("{} {}", count, count == 1 ? one : many);
  };
  const auto offline = std::ranges::count(mcus, api::McuState::kOffline);
  const auto faults = std::ranges::count(mcus, api::McuState::kFault);
  std::string text = fmt::format("{}, {}, ", counted(config.buses.size(), "bus", "buses"),
                                 counted(config.motors.size(), "motor", "motors"));
  text += offline == 0 ? "all MCUs online"
                       : counted(static_cast<std::size_t>(offline), "MCU", "MCUs") + " offline";
  if (faults == 0) return text;
  return text + ", " + counted(static_cast<std::size_t>(faults), "MCU", "MCUs") + " with a fault";
}

void tell_status(const std::string& text) {
  static_cast<void>(sd_notify(0, ("STATUS=" + text).c_str()));
}

}  // namespace bushd::daemon

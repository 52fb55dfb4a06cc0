#include "daemon/shell/service_manager.h"

#include <fmt/format.h>
#include <spdlog/details/log_msg_buffer.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/sinks/systemd_sink.h>
#include <spdlog/spdlog.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <sys/un.h>
#include <systemd/sd-daemon.h>
#include <systemd/sd-journal.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <utility>

#include "daemon/shell/write_thread.h"

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

namespace {

// Hands lines on to a thread that writes them by another sink.
class ThreadSink final : public spdlog::sinks::sink {
 public:
  explicit ThreadSink(spdlog::sink_ptr writes)
      : sink_(std::move(writes)), thread_(kLimits, [sink = sink_](std::uint64_t dropped) {
          const std::string text = fmt::format(
              "{} lines of this log were lost: they were not taken as fast as they came", dropped);
          sink->log({"bushd", spdlog::level::warn, text});
        }) {}
  void log(const spdlog::details::log_msg& line) override {
    const spdlog::details::log_msg_buffer kept(line);
    thread_.post(line.payload.size(), [sink = sink_, kept] { sink->log(kept); });
  }
  // Who writes what spdlog has no words for.
  void post(std::size_t bytes, WriteThread::Write write) { thread_.post(bytes, std::move(write)); }
  bool end() { return thread_.end(); }
  void flush() override {}
  void set_pattern(const std::string& pattern) override { sink_->set_pattern(pattern); }
  void set_formatter(std::unique_ptr<spdlog::formatter> formatter) override {
    sink_->set_formatter(std::move(formatter));
  }

 private:
  static constexpr WriteThread::Limits kLimits = {
      .lines = 4'096, .bytes = 1024 * 1024, .end = std::chrono::seconds(1)};

  spdlog::sink_ptr sink_;
  WriteThread thread_;
};

std::shared_ptr<ThreadSink> thread_sink;  // of the Log that there is

void send_to_journal(LogLevel level, const std::string& text, const JournalFields& fields) {
  std::array<std::string, 5> lines{
      "MESSAGE=" + text, "PRIORITY=" + std::to_string(priority_of(level)),
      "SYSLOG_IDENTIFIER=bushd", "MCU=" + fields.mcu, "MOTOR=" + fields.motor};
  std::array<iovec, lines.size()> parts{};
  for (std::size_t i = 0; i < lines.size(); ++i) parts[i] = field(lines[i]);
  // A motor's line is one of its MCU too; not the other way round.
  static_cast<void>(sd_journal_sendv(parts.data(), fields.motor.empty() ? 4 : 5));
}

}  // namespace

Log::Log() {
  journal_used = is_journal(STDERR_FILENO);
  spdlog::sink_ptr sink = journal_used
                              ? spdlog::sink_ptr(std::make_shared<spdlog::sinks::systemd_sink_st>())
                              : std::make_shared<spdlog::sinks::stderr_color_sink_mt>();
  thread_sink = std::make_shared<ThreadSink>(std::move(sink));
  spdlog::set_default_logger(std::make_shared<spdlog::logger>("bushd", thread_sink));
  if (!journal_used) spdlog::set_pattern("%Y-%m-%d %H:%M:%S.%e %l %v");
}

Log::~Log() {
  thread_sink.reset();
  spdlog::set_default_logger(spdlog::stderr_color_mt("ended"));
}

bool Log::end() {
  return thread_sink->end();
}

void write_log(LogLevel level, const std::string& text, const JournalFields& fields) {
  if (!journal_used || !thread_sink || (fields.motor.empty() && fields.mcu.empty())) {
    return spdlog::log(level_of(level), "{}", text);
  }
  thread_sink->post(text.size(), [=] { send_to_journal(level, text, fields); });
}

namespace {

// As sd_notify(3), but for waiting. False: systemd takes nothing now.
bool notify(const std::string& text) {
  const char* path = std::getenv("NOTIFY_SOCKET");
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  const std::size_t length = path == nullptr ? 0 : std::strlen(path);
  if (length == 0 || length >= sizeof address.sun_path) return true;
  std::memcpy(address.sun_path, path, length);
  if (address.sun_path[0] == '@') address.sun_path[0] = 0;  // an abstract one
  const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return true;
  const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + length);
  const ssize_t sent = ::sendto(fd, text.data(), text.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
                                reinterpret_cast<const sockaddr*>(&address), size);
  const bool full = sent < 0 && errno == EAGAIN;
  ::close(fd);
  return !full;
}

}  // namespace

void tell_ready() {
  static_cast<void>(sd_notify(0, "READY=1"));
}

void tell_stopping() {
  static_cast<void>(notify("STOPPING=1"));
}

std::int64_t alive_period_us() {
  std::uint64_t watchdog_us = 0;
  if (sd_watchdog_enabled(0, &watchdog_us) <= 0) return 0;
  return static_cast<std::int64_t>(watchdog_us / 2);
}

void tell_alive() {
  static_cast<void>(notify("WATCHDOG=1"));
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

bool tell_status(const std::string& text) {
  return notify("STATUS=" + text);
}

}  // namespace bushd::daemon

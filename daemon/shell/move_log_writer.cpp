#include "daemon/shell/move_log_writer.h"

#include <fmt/format.h>

#include <utility>

namespace bushd::daemon {

MoveLogWriter::MoveLogWriter(MoveLog log, Tell tell, WriteThread::Limits limits)
    : MoveLogWriter(std::make_shared<File>(File{.log = std::move(log), .tell = std::move(tell)}),
                    limits) {}

MoveLogWriter::MoveLogWriter(std::shared_ptr<File> file, WriteThread::Limits limits)
    : file_(file), thread_(limits, [file = std::move(file)](std::uint64_t dropped) {
        file->tell(
            LogLevel::kWarning,
            fmt::format("log of moves: {} lines were lost: the disk of its file did not take "
                        "them as fast as they came",
                        dropped));
      }) {}

void MoveLogWriter::append(const std::string& line) {
  thread_.post(line.size(), [file = file_.lock(), line] { file->append(line); });
}

void MoveLogWriter::File::append(const std::string& line) {
  const auto appended = log.append(line);
  if (!appended) {
    // Once, and how many when it is over: not a line of that log for each of this one.
    if (++lost == 1) tell(LogLevel::kError, "log of moves: " + appended.error().text());
    return;
  }
  if (*appended == MoveLog::Appended::kAnew) {
    tell(LogLevel::kWarning, "log of moves: its file was removed or renamed; a new one is begun");
  }
  if (*appended == MoveLog::Appended::kFull) {
    tell(LogLevel::kWarning, "log of moves: its file was full and has been renamed to " +
                                 log.full_path() +
                                 "; a new one is begun. logrotate, daily, keeps more");
  }
  if (const std::uint64_t before = std::exchange(lost, 0); before > 0) {
    tell(LogLevel::kWarning,
         fmt::format("log of moves: is written again; {} lines were lost", before));
  }
}

}  // namespace bushd::daemon

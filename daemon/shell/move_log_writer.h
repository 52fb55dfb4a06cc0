// The log of moves as the loop has it: its lines are appended by a thread.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "daemon/model/outputs.h"
#include "daemon/shell/move_log.h"
#include "daemon/shell/write_thread.h"

namespace bushd::daemon {

class MoveLogWriter {
 public:
  // What people are told of the log; called in the thread.
  using Tell = std::function<void(LogLevel level, const std::string& text)>;
  // Some minutes of the densest moves.
  static constexpr WriteThread::Limits kLimits = {
      .lines = 50'000, .bytes = 16 * 1024 * 1024, .end = std::chrono::seconds(10)};

  MoveLogWriter(MoveLog log, Tell tell, WriteThread::Limits limits = kLimits);

  // Waits for nothing.
  void append(const std::string& line);

 private:
  struct File;
  MoveLogWriter(std::shared_ptr<File> file, WriteThread::Limits limits);

  // In the thread, which outlives the rest of this if a disk keeps it.
  struct File {
    MoveLog log;
    Tell tell;
    std::uint64_t lost = 0;  // since it could be written last
    void append(const std::string& line);
  };

  std::weak_ptr<File> file_;
  WriteThread thread_;
};

}  // namespace bushd::daemon

// The log of moves: one JSON object a line, appended whole, so that a reader never sees half a
// line. Nothing here waits for anybody.
#pragma once

#include <string>
#include <utility>

#include "base/result.h"

namespace bushd::daemon {

class MoveLog {
 public:
  // A regular file, which is made if it is not there, or /dev/null: what somebody has to read from
  // could keep the daemon waiting.
  static Result<MoveLog> open(const std::string& path);
  MoveLog(MoveLog&& other) noexcept
      : fd_(std::exchange(other.fd_, -1)), path_(std::move(other.path_)) {}
  MoveLog(const MoveLog&) = delete;
  MoveLog& operator=(const MoveLog&) = delete;
  ~MoveLog();  // brings it to the disk

  // kAnew: the file had been removed or renamed, and another one was begun at its path.
  enum class Appended { kOn, kAnew };
  Result<Appended> append(const std::string& line);

 private:
  MoveLog(int fd, std::string path) : fd_(fd), path_(std::move(path)) {}

  bool is_at_its_path() const;

  int fd_;
  std::string path_;
};

}  // namespace bushd::daemon

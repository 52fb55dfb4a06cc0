// The log of moves: one JSON object a line, appended whole, so that a reader never sees half a
// line.
#pragma once

#include <string>

#include "base/result.h"

namespace bushd::daemon {

class MoveLog {
 public:
  static Result<MoveLog> open(const std::string& path);
  MoveLog(MoveLog&& other) noexcept : fd_(other.fd_), path_(std::move(other.path_)) {
    other.fd_ = -1;
  }
  MoveLog(const MoveLog&) = delete;
  MoveLog& operator=(const MoveLog&) = delete;
  ~MoveLog();  // brings it to the disk

  Result<void> append(const std::string& line);

 private:
  MoveLog(int fd, std::string path) : fd_(fd), path_(std::move(path)) {}

  int fd_;
  std::string path_;
};

}  // namespace bushd::daemon

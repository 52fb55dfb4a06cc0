// The log of moves: one JSON object a line, appended whole, so that a reader never sees half a
// line. Nothing here waits for anybody.
#pragma once

#include <cstdint>
#include <string>
#include <utility>

#include "base/result.h"

namespace bushd::daemon {

class MoveLog {
 public:
  // A file that would be larger is renamed to full_path(), whatever is there, and another one is
  // begun: more than logrotate leaves from one day to the next, unless somebody floods the daemon.
  static constexpr std::uint64_t kMaxBytes = 256 * 1024 * 1024;

  // A regular file, which is made if it is not there, or /dev/null: what somebody has to read from
  // could keep the daemon waiting.
  static Result<MoveLog> open(const std::string& path, std::uint64_t max_bytes = kMaxBytes);
  MoveLog(MoveLog&& other) noexcept
      : fd_(std::exchange(other.fd_, -1)),
        path_(std::move(other.path_)),
        max_bytes_(other.max_bytes_) {}
  MoveLog(const MoveLog&) = delete;
  MoveLog& operator=(const MoveLog&) = delete;
  ~MoveLog();  // brings it to the disk

  // kAnew: the file had been removed or renamed, and another one was begun at its path. kFull: it
  // was full, and was renamed.
  enum class Appended { kOn, kAnew, kFull };
  Result<Appended> append(const std::string& line);

  std::string full_path() const { return path_ + ".full"; }

 private:
  MoveLog(int fd, std::string path, std::uint64_t max_bytes)
      : fd_(fd), path_(std::move(path)), max_bytes_(max_bytes) {}

  bool is_at_its_path() const;
  bool has_room(std::size_t bytes) const;
  Result<void> begin_anew();

  int fd_;
  std::string path_;
  std::uint64_t max_bytes_;
};

}  // namespace bushd::daemon

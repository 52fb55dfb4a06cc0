// The file by which clients come to the daemon: its folder, its rights, and the lock beside it that
// keeps a second daemon from it.
#pragma once

#include <sys/types.h>

#include <optional>
#include <string>

#include "base/result.h"
#include "control/pid_lock.h"

namespace bushd::control {

class Listener {
 public:
  // Makes the file, in a folder that is made too with all that lead there. `group`: may use it too;
  // empty: nobody else. Fails if a daemon that lives has it already.
  static Result<Listener> open(const std::string& path, const std::string& group);

  Listener(Listener&& other) noexcept;
  Listener& operator=(Listener&&) = delete;
  ~Listener();

  int fd() const { return fd_; }
  const std::string& path() const { return path_; }
  // The file is there, and is this one's.
  bool in_place() const;
  // Makes the file anew, with another descriptor. If it fails, nothing is changed.
  Result<void> restore();

 private:
  Listener(std::string path, std::string group)
      : path_(std::move(path)), group_(std::move(group)) {}
  Result<void> make();

  std::string path_;
  std::string group_;
  std::optional<PidLock> lock_;
  int fd_ = -1;
  dev_t device_ = 0;  // of the file
  ino_t inode_ = 0;
};

}  // namespace bushd::control

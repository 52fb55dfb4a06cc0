// A lock that ends with the process that holds it, and that names the holder to others.
#pragma once

#include <optional>
#include <string>
#include <utility>

namespace bushd::control {

class PidLock {
 public:
  struct Attempt;
  // Makes the file if it is not there; it stays, for two could hold "the" lock otherwise.
  static Attempt take(const std::string& path);

  PidLock(PidLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  PidLock(const PidLock&) = delete;
  PidLock& operator=(const PidLock&) = delete;
  ~PidLock();

  // The file of this name is the locked one: nobody has deleted it.
  bool is_at(const std::string& path) const;

 private:
  explicit PidLock(int fd) : fd_(fd) {}

  int fd_;
};

// One of these: the lock; who holds it, "pid 4711"; why there can be none.
struct PidLock::Attempt {
  std::optional<PidLock> lock{};
  std::string holder{};
  std::string error{};
};

}  // namespace bushd::control

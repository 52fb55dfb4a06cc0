// A file descriptor that closes itself.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <utility>

#include "base/result.h"

namespace bushsim {

inline constexpr std::size_t kReadBytes = 4096;
// Where nothing is to be done; edges are written meanwhile.
inline constexpr std::int64_t kIdleSleepNs = 20'000'000;

class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor();

  int get() const { return fd_; }
  bool valid() const { return fd_ >= 0; }

 private:
  int fd_ = -1;
};

// The error of the system call that has just failed: "WHAT: reason of errno".
bushd::Error system_error(const std::string& what);

}  // namespace bushsim

// Memory that nobody may touch for a while, as AddressSanitizer sees it; without one it is nothing.
#pragma once

#include <cstddef>
#include <utility>

#if defined(__SANITIZE_ADDRESS__)
#define BUSHD_HAS_ASAN 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define BUSHD_HAS_ASAN 1
#endif
#endif
#ifdef BUSHD_HAS_ASAN
#include <sanitizer/asan_interface.h>
#else
#define ASAN_POISON_MEMORY_REGION(at, size) (static_cast<void>(at), static_cast<void>(size))
#define ASAN_UNPOISON_MEMORY_REGION(at, size) (static_cast<void>(at), static_cast<void>(size))
#endif

namespace bushd::fuzz {

class Poisoned {
 public:
  Poisoned() = default;
  Poisoned(const void* at, std::size_t size) : at_(at), size_(size) {
    ASAN_POISON_MEMORY_REGION(at_, size_);
  }
  Poisoned(Poisoned&& other) noexcept
      : at_(std::exchange(other.at_, nullptr)), size_(std::exchange(other.size_, 0)) {}
  Poisoned& operator=(Poisoned&&) = delete;
  ~Poisoned() {
    if (at_ != nullptr) ASAN_UNPOISON_MEMORY_REGION(at_, size_);
  }

 private:
  const void* at_ = nullptr;
  std::size_t size_ = 0;
};

}  // namespace bushd::fuzz

// Requests that are carried out, and whose end is waited for.
#pragma once

#include <cstddef>
#include <list>
#include <utility>

#include "api/session.h"

namespace bushd::daemon {

// At most so many at a time: anybody may send them, as fast as can be. Beyond, they are carried out
// all the same, and the oldest is answered without its end.
inline constexpr std::size_t kMostAwaited = 256;

// `One` has an `asker`.
template <class One>
class Awaited {
 public:
  // `without_end`: what the oldest of too many is told.
  void add(One one, const api::Completed& without_end) {
    if (all_.size() >= kMostAwaited) {
      all_.front().asker.answer(without_end);
      all_.pop_front();
    }
    all_.push_back(std::move(one));
  }
  bool empty() const { return all_.empty(); }
  // Those that it returns true for have been answered.
  void follow(const auto& is_answered) { std::erase_if(all_, is_answered); }

 private:
  std::list<One> all_;
};

inline api::Completed stopped_without_end() {
  return {.outcome = api::Outcome::kStopped,
          .reason = "carried out; so many stops are under way that its end is not waited for",
          .detail = {}};
}

}  // namespace bushd::daemon

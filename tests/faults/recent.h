// The last things that happened, for the story of a violation.
#pragma once

#include <deque>
#include <string>

#include "sim/edge.h"

namespace bushfaults {

class Recent {
 public:
  void note(bushd::sim::TimeNs now_ns, std::string text);
  // One line each, oldest first.
  std::string text() const;

 private:
  static constexpr std::size_t kKept = 60;
  struct Event {
    bushd::sim::TimeNs time_ns;
    std::string text;
  };
  std::deque<Event> events_;
};

// "12.345678" in seconds.
std::string in_seconds(bushd::sim::TimeNs ns);

}  // namespace bushfaults

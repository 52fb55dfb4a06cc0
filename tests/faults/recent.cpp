#include "recent.h"

#include <fmt/core.h>

namespace bushfaults {

std::string in_seconds(bushd::sim::TimeNs ns) {
  return fmt::format("{}.{:06}", ns / 1'000'000'000, ns / 1000 % 1'000'000);
}

void Recent::note(bushd::sim::TimeNs now_ns, std::string text) {
  if (events_.size() == kKept) events_.pop_front();
  events_.push_back({now_ns, std::move(text)});
}

std::string Recent::text() const {
  std::string all;
  for (const Event& event : events_) {
    all += fmt::format("  {:>16}  {}\n", in_seconds(event.time_ns), event.text);
  }
  return all;
}

}  // namespace bushfaults

#include "daemon/shell/port_search.h"

#include <algorithm>
#include <utility>

#include "config/port_pattern.h"

namespace bushd::daemon {

std::vector<std::string> in_order(std::vector<std::string> matches, const PortOrder& order) {
  if (order.path.empty()) return matches;
  const auto first = order.behind ? std::ranges::upper_bound(matches, order.path)
                                  : std::ranges::lower_bound(matches, order.path);
  std::ranges::rotate(matches, first);
  if (order.behind) std::erase(matches, order.path);
  return matches;
}

PortSearch::PortSearch(const std::string& port, std::size_t mcus)
    : time_us_(kBootUs + kMcuUs * static_cast<std::int64_t>(mcus)),
      searches_(config::is_pattern(port)) {}

void PortSearch::opened(std::int64_t now_us, const std::string& path) {
  path_ = path;
  due_us_ = searches_ ? now_us + time_us_ : kNever;
}

void PortSearch::lost() {
  due_us_ = kNever;
  told_.clear();
}

void PortSearch::found() {
  found_ = path_;
  due_us_ = kNever;
  told_.clear();
}

}  // namespace bushd::daemon

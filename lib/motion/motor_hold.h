// Whether motions of a motor are held back, and by whom.
#pragma once

#include <optional>
#include <string>
#include <utility>

namespace bushd::motion {

class MotorHold {
 public:
  // No motion of it is to begin. `how`: by whom and since when, "by panel since ... UTC".
  void set(std::string how) { how_ = std::move(how); }
  void release() { how_.reset(); }
  bool is_set() const { return how_.has_value(); }
  const std::optional<std::string>& how() const { return how_; }
  // Precondition: is_set().
  std::string text() const { return "it is held " + *how_; }

 private:
  std::optional<std::string> how_;
};

}  // namespace bushd::motion

// How far the motors of a request have come, while its result is awaited: on stderr, a bar on a
// terminal, else a line now and then.
#pragma once

#include <chrono>
#include <map>
#include <optional>
#include <string>

#include "api/request.h"
#include "client/status.h"

namespace bushctl {

// Columns of this terminal but the last one, where some terminals would go on to the next line.
std::size_t columns_of_terminal(int fd);

class Progress {
 public:
  using Clock = std::chrono::steady_clock;
  static constexpr std::chrono::seconds kBetweenLines{10};

  explicit Progress(const bushd::api::MotorNames& motors);

  // The motor that has the longest way to go, as far as its speed tells: "theta [===>    ] 40 %, at
  // 5 of 12.5 mm, 12 s left". "": none of them has a way to go, or nothing is known of it yet.
  // `columns`: of the bar, 0: none.
  std::string text(const bushd::client::Status& status, std::size_t columns);

  void show(const bushd::client::Status& status);
  // Before anything else is written.
  void clear();

 private:
  bushd::api::MotorNames asked_;                      // names and patterns
  std::map<std::string, std::int64_t> from_steps_{};  // as seen first
  bool terminal_;
  bool shown_ = false;
  Clock::time_point next_line_;
};

}  // namespace bushctl

// Tables of lines, put into their MCUs before the lines begin. A request for a line waits for that
// in WaitingRequests. As soon as one of these MCUs does not rest, or does not take the table, the
// wait is over: a line without its table is streamed, and one for the trigger is refused.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "api/request.h"
#include "daemon/services/lines.h"

namespace bushd::daemon {

class LineTables {
 public:
  LineTables(Installation& installation, const Lines& lines)
      : installation_(installation), lines_(lines) {}

  // What one request waits for.
  struct Wait {
    bool looked = false;  // whether there is anything to wait for
    std::optional<Lines::WantedTable> table{};
    std::int64_t deadline_us = 0;
  };
  static bool concerns(const api::Request& request);
  // Whether the request may be carried out, as far as tables of lines are concerned. If not, one is
  // being uploaded: ask again after the next step.
  bool make_ready(std::int64_t now_us, const api::Request& request, Wait& wait);
  // The request waits no more. What is not there yet is not uploaded any further.
  void end(Wait& wait);

 private:
  void begin(std::int64_t now_us, const api::Request& request, Wait& wait);
  bool is_over(std::int64_t now_us, const Wait& wait) const;

  Installation& installation_;
  const Lines& lines_;
  std::vector<McuId> waiting_;  // of all lines that wait
};

}  // namespace bushd::daemon

// Where motors stand: what `bushctl where` shows.
#pragma once

#include <string>
#include <vector>

#include "base/result.h"
#include "client/status.h"

namespace bushctl {

// One motor, from what the daemon tells of it.
struct Whereabouts {
  std::string mcu;
  bushd::api::MotorState state;
  bushd::api::MotorDescription description;
  double age_s = 0;  // of the state
};

// Where these motors stand, in this order; none named: all. Error: a name that is none.
bushd::Result<std::vector<Whereabouts>> where(const bushd::client::Status& status,
                                              const std::vector<std::string>& names,
                                              std::int64_t now_us);

std::vector<std::string> table(const std::vector<Whereabouts>& motors);

// {"motors": [...]}, each as `status` has it.
std::string json(const std::vector<Whereabouts>& motors);

}  // namespace bushctl

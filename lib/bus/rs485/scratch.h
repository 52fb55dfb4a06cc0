// The volatile table bank of one MCU (BUSHD_SCRATCH_BANK): what is in it, and
// the requests that put another one there.
#pragma once

#include <cstdint>
#include <vector>

#include "bus/rs485/request_queue.h"
#include "engine/message.h"
#include "engine/table.h"

namespace bushd::link {

class Scratch {
 public:
  // From now on this table is being uploaded, in place of what was there. It is copied.
  void upload(const bushd_table& table);
  // What is in the bank is not known.
  void clear();

  bool under_way() const { return !requests_.empty(); }
  // The next request. Precondition: one is under way.
  const Request& front() const { return requests_.front(); }
  // Notes that it is being sent, and returns it.
  const Request& ask() {
    asked_ = true;
    return front();
  }
  // The MCU has answered a request of this type with this status. A refusal ends the upload. What
  // answers a request of an earlier upload is ignored.
  void acknowledged(std::uint8_t type, std::uint8_t status);
  // The table that has been uploaded, whole; null if there is none.
  const bushd_table* table() const { return there_ ? &table_ : nullptr; }

 private:
  std::vector<std::uint16_t> codes_;  // of both sides, or of one if they are the same
  bushd_table table_{};
  bool there_ = false;
  bool asked_ = false;  // the next request has been sent
  RequestQueue requests_;
};

}  // namespace bushd::link

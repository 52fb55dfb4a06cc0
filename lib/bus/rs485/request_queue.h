// Requests to one MCU, made in this order, each acknowledged before the next: the setup of an MCU
// that connects, and what is asked of it later.
#pragma once

#include <cstdint>
#include <deque>
#include <utility>

#include "bus/rs485/bus_setup.h"
#include "bus/rs485/request.h"

namespace bushd::link {

class RequestQueue {
 public:
  bool empty() const { return requests_.empty(); }
  const Request& front() const { return requests_.front(); }
  void clear() { requests_.clear(); }
  // Drops what a setup has asked for, since a new one repeats it. Other requests stay; so does
  // CONTROL, which may be either, and does no harm twice.
  void discard_setup();
  // Whether a setup may have such requests.
  static bool may_be_setup(std::uint8_t type);
  // The first request has been answered, if it is of this type. Returns false if it is not.
  bool done(std::uint8_t type);

  void ask(Request request) { requests_.push_back(std::move(request)); }
  template <class Message>
  void ask(const Message& message) {
    ask(request_of(message));
  }
  // Which tables it has.
  void ask_for_tables() { ask(Request{.type = BUSHD_MSG_TABLES, .payload = {}}); }
  void upload_table(std::uint8_t bank, const TableRef& ref);
  // What was asked before an emergency stop must not clear it.
  void discard_clearing();

 private:
  std::deque<Request> requests_;
};

}  // namespace bushd::link

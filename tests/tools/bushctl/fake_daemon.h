// What a client sees of bushd on LCM, in a thread of its own: a state 50 times a second, and
// replies as told.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "api/reply.h"
#include "api/request.h"
#include "lcm/codec.h"
#include "lcm/transport.h"

namespace bushctl::test {

namespace api = bushd::api;

class FakeDaemon {
 public:
  // Two MCUs with two motors each: theta, chi, phi, stop.
  FakeDaemon();
  FakeDaemon(const FakeDaemon&) = delete;
  FakeDaemon& operator=(const FakeDaemon&) = delete;

  // Replies to a request; `times` counts how often just this one has come (1: the first time). Set
  // before start().
  using Answer = std::function<std::vector<api::Reply>(const api::Request&, int times)>;
  void start(Answer answer = {});
  // One that has been started.
  explicit FakeDaemon(Answer answer) : FakeDaemon() { start(std::move(answer)); }
  ~FakeDaemon();

  // Each once, however often it came.
  std::vector<api::Request> requests() const;
  std::vector<std::string> client_ids() const;
  // From now on it is another run of the daemon.
  void restart() { ++run_; }
  void set_name(const std::string& name) { name_ = name; }  // of the first motor, before start()
  // As if the second MCU's states were lost; before start().
  void lose_second_mcu() { loses_ = true; }
  // So many messages of each that is sent are lost, from now on.
  void lose(std::int64_t messages) { lost_ = messages; }
  // Sent along with every state, before start().
  void set_hostile_states(std::vector<std::vector<std::uint8_t>> payloads) {
    hostile_ = std::move(payloads);
  }

 private:
  void run();
  void on_message(std::string_view channel, bushd::lcm::Payload payload);
  void on_request(const bushd::lcm::RequestId& id, const api::Request& request);
  void publish_state();
  void publish_rest();
  void publish(const bushd::Result<bushd::lcm::Packet>& packet);
  bushd::lcm::Part part(std::int32_t index, std::int32_t parts);

  std::unique_ptr<bushd::lcm::Transport> transport_;
  Answer answer_;
  std::string name_ = "theta";
  std::vector<std::vector<std::uint8_t>> hostile_;
  bool loses_ = false;
  std::atomic<std::int64_t> lost_{0};
  std::atomic<std::int64_t> run_{7};
  std::int64_t sequence_ = 0;
  std::atomic<bool> ended_{false};
  mutable std::mutex mutex_;
  std::vector<api::Request> requests_;                         // guarded by mutex_
  std::vector<std::string> client_ids_;                        // so are these
  std::map<std::pair<std::string, std::int64_t>, int> times_;  // by client_id and number
  std::thread thread_;
};

// One result for all motors of a move, which stand at 7.
api::Reply result(const api::Request& request, api::Outcome outcome);

}  // namespace bushctl::test

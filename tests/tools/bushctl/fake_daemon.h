// What a client sees of bushd, in a thread of its own: a state 50 times a second, and replies as
// told.
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

#include "bushd/command_t.hpp"
#include "bushd/reply_t.hpp"
#include "bushd/state_t.hpp"
#include "lcm/transport.h"

namespace bushctl::test {

class FakeDaemon {
 public:
  // Two MCUs with two motors each: theta, chi, phi, stop.
  FakeDaemon();
  ~FakeDaemon();
  FakeDaemon(const FakeDaemon&) = delete;
  FakeDaemon& operator=(const FakeDaemon&) = delete;

  // Replies to a command; `times` counts how often just this one has come (1: the first time).
  // Phase, result and the per-motor fields matter, the rest is filled in. Set before start().
  using Answer = std::function<std::vector<bushd::reply_t>(const bushd::command_t&, int times)>;
  void start(Answer answer = {});

  // Each once, however often it came.
  std::vector<bushd::command_t> commands() const;
  // From now on snapshots are counted as after a restart.
  void restart() { sequence_ = 0; }
  void set_name(const std::string& name) { name_ = name; }  // of the first motor, before start()
  // Sent along with every state, before start().
  void set_hostile_states(std::vector<std::vector<std::uint8_t>> payloads) {
    hostile_ = std::move(payloads);
  }

 private:
  void run();
  void on_command(const bushd::command_t& command);
  void publish_state();

  std::unique_ptr<bushd::lcm::Transport> transport_;
  Answer answer_;
  std::string name_ = "theta";
  std::vector<std::vector<std::uint8_t>> hostile_;
  std::atomic<std::int64_t> sequence_{1000};
  std::atomic<bool> ended_{false};
  mutable std::mutex mutex_;
  std::vector<bushd::command_t> commands_;                     // guarded by mutex_
  std::map<std::pair<std::string, std::int64_t>, int> times_;  // by client_id and number
  std::thread thread_;
};

bushd::reply_t accepted();
bushd::reply_t refused(const std::string& reason);
// One result for all motors of the command, which stand at 7.
bushd::reply_t result(const bushd::command_t& command, const std::string& word);

}  // namespace bushctl::test

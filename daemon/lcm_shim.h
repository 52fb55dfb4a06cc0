// The core as clients of the message types command_t, reply_t, state_t and health_t see it: a
// translation and nothing else, until these types are gone.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "bushd/command_t.hpp"
#include "bushd/health_t.hpp"
#include "bushd/reply_t.hpp"
#include "bushd/state_t.hpp"
#include "daemon/client_log.h"
#include "daemon/core.h"

namespace bushd::daemon {

// As Outputs, in messages.
class LcmOutputs {
 public:
  virtual ~LcmOutputs() = default;
  virtual void send(BusId bus, std::span<const std::uint8_t> bytes) = 0;
  virtual void reply(const reply_t& reply) = 0;
  virtual void state(const state_t& state) = 0;
  virtual void health(const health_t& health) = 0;
  virtual void move_log(const std::string& json_line) = 0;
  virtual void log(LogLevel level, const std::string& text) = 0;
  virtual void read_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) = 0;
  virtual void keep_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) = 0;
  virtual std::int64_t wall_clock_us() = 0;
};

class LcmShim final : private Outputs {
 public:
  LcmShim(const config::Config& config, LcmOutputs& outputs, std::uint16_t master);

  Core& core() { return core_; }
  void command(std::int64_t now_us, const command_t& command);
  // Payloads that were no valid command, so far; shown in the state.
  void set_rejected_commands(std::uint64_t count) { rejected_commands_ = count; }

 private:
  class Client;
  void answer(const std::string& client_id, std::int64_t number, const api::Reply& reply);

  // Outputs
  void publish(McuId mcu, const api::StateSnapshot& state) override;
  void publish(McuId mcu, const api::Description& description) override;
  void publish(BusId bus, const api::HealthSnapshot& health) override;
  void serve_tables(const api::Asker& asker, const api::Request& request) override;
  void send(BusId bus, std::span<const std::uint8_t> bytes) override { out_.send(bus, bytes); }
  void move_log(const std::string& line) override { out_.move_log(line); }
  void log(LogLevel level, const std::string& text) override { out_.log(level, text); }
  void read_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) override {
    out_.read_tables(ticket, wanted);
  }
  void keep_tables(std::uint64_t ticket, const std::vector<std::string>& wanted) override {
    out_.keep_tables(ticket, wanted);
  }
  std::int64_t wall_clock_us() override { return out_.wall_clock_us(); }

  const config::Config& config_;
  LcmOutputs& out_;
  ClientLog clients_;
  ById<McuId, api::Description> descriptions_;
  std::uint64_t rejected_commands_ = 0;
  std::int64_t state_sequence_ = 0;
  std::int64_t health_sequence_ = 0;
  Core core_;
};

}  // namespace bushd::daemon

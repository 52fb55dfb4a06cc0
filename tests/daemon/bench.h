// An installation on a bench: buses, MCUs and motors of a configuration, of which no MCU has been
// heard; a client, and what it was told. For services by themselves; lab.h has everything.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "daemon/lab.h"
#include "daemon/model/installation.h"
#include "daemon/model/outputs.h"

namespace bushd::test {

class Bench : public daemon::Outputs {
 public:
  explicit Bench(const std::string& toml = hall(2, 2));
  ~Bench() override;

  struct Client final : api::Session {
    Client();
    ~Client() override;
    void answer(std::int64_t number, const api::Reply& reply) override;
    std::vector<std::pair<std::int64_t, api::Reply>> answers;
  };
  api::Asker asker(std::int64_t number = 1) const { return {client, number}; }
  // What the last answer says.
  std::string refusal() const;
  api::Completed completed() const;
  MotorId motor(const std::string& name) const;

  void send(BusId, std::span<const std::uint8_t>) override {}
  void publish(McuId, const api::StateSnapshot& state) override;
  void publish(McuId, const api::Description& description) override;
  void publish(BusId, const api::HealthSnapshot& snapshot) override;
  void move_log(const std::string& line) override;
  void log(daemon::LogLevel level, daemon::LogSubject, const std::string& text) override;
  void read_tables(std::uint64_t ticket, const std::vector<std::string>& names) override;
  void keep_tables(std::uint64_t ticket, const std::vector<std::string>& names) override;
  void serve_tables(const api::Asker&, const api::Request&) override {}
  std::int64_t wall_clock_us() override { return 1'000'000; }

  config::Config config;
  daemon::Installation installation;
  std::shared_ptr<Client> client;
  std::vector<api::StateSnapshot> states;
  std::vector<api::Description> descriptions;
  std::vector<api::HealthSnapshot> health;
  std::vector<std::string> lines;                                     // of the log of moves
  std::vector<std::string> warnings;                                  // and errors, of the log
  using Tables = std::pair<std::uint64_t, std::vector<std::string>>;  // ticket, names
  std::vector<Tables> to_read;
  std::vector<Tables> to_keep;
};

}  // namespace bushd::test

// An installation on a bench: buses, MCUs and motors of a configuration, of which no MCU has been
// heard; a client, and what it was told. For services by themselves; lab.h has everything.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "daemon/installation.h"
#include "daemon/lab.h"
#include "daemon/outputs.h"

namespace bushd::test {

class Bench : public daemon::Outputs {
 public:
  explicit Bench(const std::string& toml = hall(2, 2))
      : config(load(toml)), installation(config, 1), client(std::make_shared<Client>()) {}

  struct Client final : api::Session {
    Client() : Session(api::Transport::kLcm, "test", true) {}
    void answer(std::int64_t number, const api::Reply& reply) override {
      answers.emplace_back(number, reply);
    }
    std::vector<std::pair<std::int64_t, api::Reply>> answers;
  };
  api::Asker asker(std::int64_t number = 1) const { return {client, number}; }
  // Of the last answer.
  std::string refusal() const {
    return std::get<api::Refused>(client->answers.back().second).reason;
  }
  api::Completed completed() const {
    return std::get<api::Completed>(client->answers.back().second);
  }
  MotorId motor(const std::string& name) const { return installation.find(name).value(); }

  void send(BusId, std::span<const std::uint8_t>) override {}
  void publish(McuId, const api::StateSnapshot& state) override { states.push_back(state); }
  void publish(McuId, const api::Description& description) override {
    descriptions.push_back(description);
  }
  void publish(BusId, const api::HealthSnapshot& snapshot) override { health.push_back(snapshot); }
  void move_log(const std::string& line) override { lines.push_back(line); }
  void log(daemon::LogLevel level, daemon::LogSubject, const std::string& text) override {
    if (level != daemon::LogLevel::kInfo) warnings.push_back(text);
  }
  void read_tables(std::uint64_t ticket, const std::vector<std::string>& names) override {
    to_read.emplace_back(ticket, names);
  }
  void keep_tables(std::uint64_t ticket, const std::vector<std::string>& names) override {
    to_keep.emplace_back(ticket, names);
  }
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

 private:
  static config::Config load(const std::string& toml) {
    auto parsed = config::parse(toml, "/nonexistent/bushd.toml");
    if (!parsed) throw std::runtime_error(parsed.error().text());
    return std::move(*parsed);
  }
};

}  // namespace bushd::test

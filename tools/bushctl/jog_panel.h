// A motor moved by the keys of a terminal.
#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "api/request.h"
#include "client/client.h"
#include "jog_amounts.h"
#include "jog_keys.h"
#include "raw_terminal.h"

namespace bushctl {

struct JogPanelOptions {
  std::string motor{};
  bool in_steps = false;  // else in the motor's unit
  double speed = 0;       // the first one; 0: as the motor's table starts
  double step = 0;        // the first one; 0: a few steps of the motor
  std::int64_t keepalive_ms = 500;
};

class JogPanel {
 public:
  // Standard input and output are a terminal, and SIGHUP is taken (take_hangup_too).
  JogPanel(bushd::client::Client& client, JogPanelOptions options);

  // Until q, Ctrl-C or the end of the terminal; the motor stands then. The exit code.
  int run();

 private:
  using Client = bushd::client::Client;
  using Status = bushd::client::Status;
  using Clock = std::chrono::steady_clock;

  bool find_motor();
  bool find_amounts(const bushd::api::MotorDescription& motor);
  void wait_at_rest();
  void hear_daemon();
  void read_keys();
  bool change_speed();
  void suspend();

  void jog();
  void make_step();
  // With what the keys and the terminal need meanwhile. `beside`: what to send beside the request.
  void run_one(const bushd::api::Request& request, const bushd::api::Request& ending,
               const std::function<std::optional<bushd::api::Request>()>& beside);
  void has_ended(const bushd::Result<bushd::api::Reply>& reply);
  bushd::api::Jog jog_at(double speed) const;
  std::chrono::milliseconds renewal() const;

  void take(const Status& status);
  bool is_silent() const;
  void draw();
  void say(const std::string& text);

  Client& client_;
  JogPanelOptions options_;
  JogKeys keys_;
  JogAmounts amounts_;
  std::string stands_;  // where the motor does
  std::string bounds_;  // its limits, and what else is to be known
  Clock::time_point heard_at_{};
  std::optional<RawTerminal> terminal_;
  Clock::time_point renewed_at_{};
  bool over_ = false;
  int result_ = 0;
};

}  // namespace bushctl

// The core still speaks the messages of before lib/api: requests become those here, and what it
// says becomes replies and snapshots. Goes when the core takes api::Request itself.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <utility>

#include "api/session.h"
#include "api/snapshot.h"
#include "bushd/command_t.hpp"
#include "bushd/health_t.hpp"
#include "bushd/reply_t.hpp"
#include "bushd/state_t.hpp"
#include "bushd/table_reply_t.hpp"
#include "bushd/table_request_t.hpp"
#include "config/config.h"

namespace bushd::daemon {

class ApiShim {
 public:
  // `accepted` is told of every request that the core has accepted, before its answer is sent.
  using Accepted = std::function<void(const api::Asker&, const api::Request&)>;
  ApiShim(const config::Config& config, api::Publisher& publisher, Accepted accepted)
      : config_(config), publisher_(publisher), accepted_(std::move(accepted)) {}

  // What Core::carry_out takes. Precondition: no request about table files.
  command_t command(const api::Asker& asker, const api::Request& request);
  // Finds who asked.
  void reply(const reply_t& reply);
  void state(const state_t& state);
  void health(const health_t& health);

  static bool is_about_table_files(const api::Request& request);
  static table_request_t table_request(const api::Asker& asker, const api::Request& request);
  static api::Reply reply_of(const table_reply_t& reply, const api::Request& request);

 private:
  const config::Config& config_;
  api::Publisher& publisher_;
  Accepted accepted_;
  struct UnderWay {
    api::Asker asker;
    api::Request request;
  };
  std::map<std::pair<std::string, std::int64_t>, UnderWay> under_way_;
};

}  // namespace bushd::daemon

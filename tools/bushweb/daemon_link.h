// Connections to daemons: one that hears all that a daemon tells, and one for each page that asks
// for something.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>

#include "client/link.h"
#include "page.h"
#include "poller.h"
#include "source.h"

namespace bushweb {

// A daemon of this installation.
struct DaemonName {
  std::string name{};    // on the page
  std::string socket{};  // path
};

class DaemonLink : public Connection {
 public:
  struct Handlers {
    std::function<void(std::int64_t number, const api::Reply&)> reply;
    std::function<void(const std::string& why)> ended;  // the link may be destroyed within
  };
  // `program`: begins its client_id. Never waits for a daemon.
  static bushd::Result<std::unique_ptr<DaemonLink>> open(Poller& poller, const std::string& socket,
                                                         const std::string& program,
                                                         Handlers handlers);
  ~DaemonLink() override;

  bushd::Result<std::int64_t> send(const api::Request& request) override;

 private:
  DaemonLink(Poller& poller, std::unique_ptr<bushd::client::Link> link, std::string id,
             Handlers handlers);
  void handle();

  Poller& poller_;
  std::unique_ptr<bushd::client::Link> link_;
  std::string id_;
  Handlers handlers_;
  std::int64_t number_ = 0;
  std::map<std::int64_t, bushd::lcm::ReplyParts> parts_{};  // of replies that come in several
};

// Keeps the mirror of one daemon, and comes back when the daemon does.
class Watch : public Source {
 public:
  static constexpr std::int64_t kTryAgainUs = 500'000;

  Watch(Poller& poller, DaemonName daemon);
  ~Watch() override;
  Watch(const Watch&) = delete;
  Watch& operator=(const Watch&) = delete;

  Mirror& mirror() override { return mirror_; }
  void tick(std::int64_t now_us) override;
  std::string socket() const override { return daemon_.socket; }
  std::optional<double> cpu_s() const override;

 private:
  bushd::Result<void> connect();
  void handle();
  void disconnect(const std::string& why);

  Poller& poller_;
  DaemonName daemon_;
  Mirror mirror_;
  std::unique_ptr<bushd::client::Link> link_{};
  std::int64_t try_at_us_ = 0;
};

}  // namespace bushweb

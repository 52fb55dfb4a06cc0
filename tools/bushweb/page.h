// One page that is open: what it asks of daemons, by connections of its own, so that their
// histories name who has asked and its jogs end with it. Takes time and messages as parameters.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "api/reply.h"
#include "api/request.h"
#include "base/result.h"
#include "messages.h"

namespace bushweb {

// A connection to a daemon in somebody's name. Its owner is told what is answered, and its end.
class Connection {
 public:
  virtual ~Connection() = default;
  // The number of the request. Never blocks: what cannot be sent now is an error.
  virtual bushd::Result<std::int64_t> send(const api::Request& request) = 0;
};

// What a page needs of the process around it.
class Surroundings {
 public:
  virtual ~Surroundings() = default;
  virtual void tell(const Text& text) = 0;
  virtual bool has_daemon(const std::string& daemon) const = 0;
  // `link`: what on_reply() and on_end() call it. `program`: what history calls it.
  virtual bushd::Result<std::unique_ptr<Connection>> connect(const std::string& daemon,
                                                             const std::string& link,
                                                             const std::string& program) = 0;
  // What `bushctl doctor` says of this daemon, later, as reply `id`.
  virtual void run_doctor(const std::string& daemon, std::int64_t id) = 0;
};

class Page {
 public:
  // Requests whose results have not come.
  static constexpr std::size_t kMostOpen = 256;
  // Messages: so many at once, and so many a second.
  static constexpr double kBurst = 300;
  static constexpr double kPerSecond = 100;
  // Those larger than this, which only who may command sends: so many bytes at once, and a second.
  static constexpr std::size_t kSmall = 4096;
  static constexpr double kByteBurst = 2'000'000;
  static constexpr double kBytesPerSecond = 500'000;
  // What a page asks that has not heard of bushd-web for so long comes late: a network has held it
  // back, and whoever asked has given up.
  static constexpr std::int64_t kLateUs = 2'000'000;

  Page(Surroundings& surroundings, Rights rights, std::int64_t now_us);

  const Rights& rights() const { return rights_; }
  void set_rights(const Rights& rights);

  void hear(std::string_view text, std::int64_t now_us);
  void on_reply(const std::string& link, std::int64_t number, const api::Reply& reply);
  // The connection has ended: what was under way is answered.
  void on_end(const std::string& link, const std::string& why);

 private:
  struct Link {
    std::unique_ptr<Connection> connection;
    std::map<std::int64_t, std::int64_t> ids{};  // of open requests, by their numbers
  };

  void ask(std::int64_t id, const Ask& ask, std::int64_t now_us);
  // Why it has not been sent; "": it has.
  std::string send(std::int64_t id, const Ask& ask, const std::string& link);
  // "": it may.
  std::string why_not(const Ask& ask, std::int64_t now_us) const;
  std::size_t open_requests() const;
  bool is_within_rate(std::size_t bytes, std::int64_t now_us);
  std::string program() const;

  Surroundings& surroundings_;
  Rights rights_;
  double messages_left_ = kBurst;
  double bytes_left_ = kByteBurst;
  std::int64_t filled_at_us_;
  std::map<std::string, Link> links_{};
};

}  // namespace bushweb

// A way to the daemon: the control socket of this PC, or LCM.
#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <string>

#include "base/result.h"
#include "lcm/codec.h"

namespace bushd::client {

class Link {
 public:
  using Handler = std::function<void(const lcm::DaemonMessage&)>;

  virtual ~Link() = default;

  // Readable (level-triggered) while messages wait.
  virtual int fd() const = 0;
  virtual Result<void> send(const lcm::Packet& packet) = 0;
  // Hands over what waits. Fails when the daemon has closed the connection.
  virtual Result<void> handle(const Handler& handler) = 0;
  // Messages may be lost or repeated, and who speaks needs a session. Else all arrive, in order, or
  // the link ends.
  virtual bool loses() const = 0;
  // For errors: what has to be there for a daemon to answer.
  virtual std::string remedy() const = 0;
};

Result<std::unique_ptr<Link>> open_lcm(const std::string& url, const std::string& prefix);

// What every client heeds.
inline constexpr const char* kNameAnother = "$BUSHD_CONTROL";
// How long a daemon that has no time is waited for, when connecting and when sending. Who serves
// others meanwhile does not wait.
struct Patience {
  std::chrono::milliseconds connect{3000};
  std::chrono::milliseconds send{3000};
};
inline constexpr Patience kNoPatience{.connect = std::chrono::milliseconds{0},
                                      .send = std::chrono::milliseconds{0}};
// `another`: how a user names another daemon, for the error.
Result<std::unique_ptr<Link>> open_socket(const std::string& path,
                                          const std::string& another = kNameAnother,
                                          Patience patience = {});

// There is a socket at this path, or a folder that hides it, to which this user has no right.
bool is_barred(const std::string& path);

}  // namespace bushd::client

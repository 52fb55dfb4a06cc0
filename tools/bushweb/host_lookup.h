// Addresses of hosts, looked up beside everything else: a name server may take its time.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "base/result.h"
#include "poller.h"

namespace bushweb {

class HostLookup {
 public:
  // Called by the poller; not once this is destroyed.
  using Done = std::function<void(bushd::Result<std::string> address)>;

  explicit HostLookup(Poller& poller);
  ~HostLookup();
  HostLookup(const HostLookup&) = delete;
  HostLookup& operator=(const HostLookup&) = delete;

  // A thread of its own for each; it ends when the name server has answered, or the system gives
  // up.
  void start(const std::string& host, Done done);

 private:
  struct Answers;
  void handle() const;

  Poller& poller_;
  std::shared_ptr<Answers> answers_;
};

}  // namespace bushweb

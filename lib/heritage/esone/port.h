// Where cycles go: the daemon, or a crate of a test.
#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>

#include "api/reply.h"
#include "words/camac.h"

namespace bushd::esone {

// Error codes of a status.
enum Code {
  kOk = 0,
  kBadBranch = 1,
  kBadCrate = 2,
  kBadStation = 3,
  kBadSubaddress = 4,
  kBadFunction = 5,
  kBadExt = 6,
  kBadLam = 7,
  kBadTimeout = 8,
  kNoDaemon = 9,
  kTransport = 11,
  kLamTimeout = 12,
  kNoCrate = 15,
  kEndBeforeStart = 20,
  kSeveralBranches = 22,
  kSeveralCrates = 23,
  kBadCount = 24,
  kNoQ = 25
};

struct Failure {
  Code code;
  std::string text;
};

class Port {
 public:
  virtual ~Port() = default;
  virtual tl::expected<api::CamacResult, Failure> run(int crate, const camac::Block& block) = 0;
  // A clock, and letting it go on.
  virtual std::int64_t now_ms() = 0;
  virtual void pause_ms(std::int64_t length_ms) = 0;
};

// The daemon, found as bushctl finds it.
Port& client_port();

// What bushd_esone.h talks to from now on. Not while a call is under way.
void use(Port& port);

}  // namespace bushd::esone

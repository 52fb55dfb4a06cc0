// Which commands of which client were answered how, so that a repeated command is answered again
// and not run again.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "bushd/reply_t.hpp"

namespace bushd::daemon {

// 1..64 printable characters. A message without has no one to be answered.
bool valid_client_id(const std::string& id);

class ClientLog {
 public:
  static constexpr std::size_t kClients = 256;  // the one longest silent is forgotten first
  static constexpr std::size_t kCommandsPerClient = 64;  // the oldest is forgotten first

  enum class Verdict {
    kNew,       // now noted; run it
    kRepeated,  // answered before: replies() are the answers so far
    kTooOld     // a number not above the highest seen, whose answers are no longer kept
  };
  Verdict note(const std::string& client_id, std::int64_t number);

  // Adds an answer to a noted command; of a forgotten client it is ignored.
  void record(const reply_t& reply);
  std::vector<reply_t> replies(const std::string& client_id, std::int64_t number) const;

 private:
  struct Client {
    std::int64_t highest = 0;
    std::uint64_t used = 0;
    std::map<std::int64_t, std::vector<reply_t>> answers;
  };
  std::unordered_map<std::string, Client> clients_;
  std::uint64_t uses_ = 0;
};

}  // namespace bushd::daemon

// Who asks, and where the answers go.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "api/reply.h"
#include "api/request.h"

namespace bushd::api {

enum class Transport {
  kLcm,
  kSocket,
  kCamac  // none: a module of a crate, in the daemon itself
};

// Who is at the other end of a socket, as the kernel tells it.
struct Credentials {
  std::int32_t pid = 0;
  std::uint32_t uid = 0;
  std::uint32_t gid = 0;
};

// 1..64 printable characters without blanks.
bool is_client_id(std::string_view id);

// Exists as long as its client may be answered: services hold it until they have said what became
// of a request. Front ends derive from it.
class Session {
 public:
  Session(Transport transport, std::string client_id, bool may_command,
          std::optional<Credentials> credentials = std::nullopt)
      : transport_(transport),
        client_id_(std::move(client_id)),
        may_command_(may_command),
        credentials_(credentials) {}
  virtual ~Session() = default;
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;

  Transport transport() const { return transport_; }
  // As the client calls itself; unique only as far as clients keep to it.
  const std::string& client_id() const { return client_id_; }
  bool may_command() const { return may_command_; }
  const std::optional<Credentials>& credentials() const { return credentials_; }
  // For logs and reasons: "CLIENT_ID", of a socket "CLIENT_ID (uid 1000, pid 4711)".
  std::string text() const;

  // To who asked, about the request with this number. Called from within the core; must not call
  // back into it. Of a client that has gone it does nothing.
  virtual void answer(std::int64_t number, const Reply& reply) = 0;
  // Its client is known to have gone; over a transport that does not tell that it never is.
  virtual bool gone() const { return false; }

 private:
  Transport transport_;
  std::string client_id_;
  bool may_command_;
  std::optional<Credentials> credentials_;
};

// One request's way back. Without a session nobody is told, as of what a signal has started.
struct Asker {
  static constexpr std::uint64_t kNotCounted = UINT64_MAX;

  std::shared_ptr<Session> session;
  std::int64_t number = 0;  // of the request, by the client's own count
  // When the request arrived: after so many that end motion (daemon/model/precedence.h). Of one
  // that ends motion itself, that one is among them.
  std::uint64_t after_stops = kNotCounted;

  void answer(const Reply& reply) const {
    if (session) session->answer(number, reply);
  }
  bool is_same_client(const Asker& other) const;
};

}  // namespace bushd::api

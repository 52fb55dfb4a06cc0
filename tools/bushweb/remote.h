// A daemon as another bushd-web shows it to its pages: to be looked at.
#pragma once

#include <cstdint>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <string_view>

#include "base/result.h"
#include "source.h"

namespace bushweb {

struct RemoteName {
  std::string name{};  // on the page
  std::string url{};   // as it was given, for errors
  std::string host{};  // of the other bushd-web
  int port = 0;
  bool tls = false;
  std::string daemon{};  // which one of its daemons; "": the first
};
// "NAME=http://HOST:PORT" or "NAME=https://HOST:PORT", with "/?daemon=DAEMON" or without.
bushd::Result<RemoteName> remote_name(const std::string& told);

class Remote;

// The way to other bushd-webs.
class Dialer {
 public:
  virtual ~Dialer() = default;
  // on_open() or on_end() follows, perhaps at once.
  virtual void dial(Remote& remote) = 0;
};

class Remote : public Source {
 public:
  static constexpr std::int64_t kTryAgainUs = 2'000'000;
  static constexpr std::int64_t kSilentUs = 5'000'000;  // then the connection is taken for dead
  static constexpr std::size_t kMostMessage = 64 * 1024 * 1024;

  Remote(RemoteName name, Dialer& dialer);

  const RemoteName& name() const { return name_; }
  Mirror& mirror() override { return mirror_; }
  void tick(std::int64_t now_us) override;
  // Nothing has come for too long: it is to be closed.
  bool is_silent() const { return open_ && now_us_ - heard_at_us_ > kSilentUs; }

  void on_open() { open_ = true; }
  // One message, whatever it is.
  void on_text(std::string_view text);
  void on_end(const std::string& why);

 private:
  void hear_state(const nlohmann::json& told);
  void hear_descriptions(const nlohmann::json& told);
  void hear_health(const nlohmann::json& told);
  bushd::lcm::Part part_of(const nlohmann::json& message, const nlohmann::json& one);

  RemoteName name_;
  Dialer& dialer_;
  Mirror mirror_;
  std::string daemon_{};  // as it is called there
  bool dialled_ = false;
  bool open_ = false;
  std::int64_t now_us_ = 0;
  std::int64_t heard_at_us_ = 0;
  std::int64_t try_at_us_ = 0;
  std::int64_t run_ = 0;  // counts what begins anew
  std::int64_t sequence_ = 0;
  std::map<std::int32_t, api::StateSnapshot> mcus_{};
};

}  // namespace bushweb

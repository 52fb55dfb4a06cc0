// The way to browsers: HTTP and WebSocket by libwebsockets, in one thread. What is said is the
// site's.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <string_view>

#include "base/result.h"
#include "host_lookup.h"
#include "poller.h"
#include "site.h"

struct lws;
struct lws_context;
struct lws_vhost;

namespace bushweb {

struct ServerOptions {
  std::string address = "127.0.0.1";
  int port = 8260;
  std::string certificate{};  // files of TLS; "": none
  std::string key{};
};

class Server : public Outlet, public Dialer {
 public:
  // Connections, and pages among them.
  static constexpr std::size_t kMostConnections = 512;
  static constexpr std::size_t kMostPages = 200;
  // So many of them are for pages that may stop or command.
  static constexpr std::size_t kKeptPages = 100;
  // What a page may send in one message, and a request over HTTP as its body.
  static constexpr std::size_t kMostMessage = 512 * 1024;
  static constexpr std::size_t kMostBody = 4096;
  // Not sent yet. From the first on a page is behind; at the second it is closed.
  static constexpr std::size_t kBehind = 256 * 1024;
  static constexpr std::size_t kMostUnsent = 16 * 1024 * 1024;
  // A page that has not taken anything for so long is closed.
  static constexpr std::int64_t kDeafUs = 10'000'000;

  explicit Server(Poller& poller) : poller_(poller), lookup_(poller) {}
  ~Server() override;
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  // Listens. Errors: the address or the port is taken or not of this PC; the files of TLS.
  bushd::Result<void> open(const ServerOptions& options);
  // Serves `site`, which is there as long, until end(). Returns false where something else has
  // ended it.
  bool run(Site& site);
  void end() { ended_ = true; }
  // Ends pages that take nothing.
  void close_deaf();

  void send(PageId page, const Text& text) override;
  bool is_behind(PageId page) const override;
  void dial(Remote& remote) override;
  // Ends connections to others that are silent.
  void close_silent();

  // What the library tells. `reason`: lws_callback_reasons.
  int on_event(lws* wsi, int reason, std::string_view in);

 private:
  // A request over HTTP, and its answer.
  struct Exchange {
    Visit visit{};
    Answer answer{};
    std::size_t sent = 0;  // of the body
    bool close = false;    // afterwards
    bool begun = false;    // the answer
  };
  struct OpenPage {
    lws* wsi = nullptr;
    std::deque<Text> unsent{};
    std::size_t bytes = 0;
    std::int64_t waits_since_us = 0;  // with something unsent
    std::string heard{};              // of a message that has not come whole
  };

  int on_http(lws* wsi, std::string_view path);
  int on_body(lws* wsi, std::string_view bytes);
  int begin_answer(lws* wsi);
  int write_body(lws* wsi);
  int on_upgrade(lws* wsi);
  int on_message(lws* wsi, std::string_view bytes);
  int write_text(lws* wsi);
  void on_page_closed(lws* wsi);
  void connect(Remote& remote, const std::string& address);
  int on_remote_event(lws* wsi, int reason, std::string_view in);

  Poller& poller_;
  HostLookup lookup_;
  Site* site_ = nullptr;
  lws_context* context_ = nullptr;
  lws_vhost* vhost_ = nullptr;
  bool ended_ = false;
  std::set<lws*> connections_{};  // of browsers
  std::map<lws*, Exchange> exchanges_{};
  std::map<lws*, Visit> upgrading_{};
  PageId last_page_ = 0;
  std::map<lws*, PageId> ids_{};
  std::map<PageId, OpenPage> pages_{};
  struct Far {
    Remote* remote = nullptr;
    std::string heard{};  // of a message that has not come whole
  };
  std::map<lws*, Far> remotes_{};
  Remote* dialled_ = nullptr;  // while dial() runs
};

}  // namespace bushweb

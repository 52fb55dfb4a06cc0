// What bushd-web serves: the page's files, what programs read, and open pages. Between the library
// of HTTP (server.h) and the daemons.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "access.h"
#include "content.h"
#include "daemon_link.h"
#include "messages.h"
#include "page.h"
#include "poller.h"
#include "program_run.h"
#include "remote.h"
#include "token_file.h"

namespace bushweb {

using PageId = std::uint64_t;

// The way to open pages.
class Outlet {
 public:
  virtual ~Outlet() = default;
  virtual void send(PageId page, const Text& text) = 0;
  // It has not taken yet what it was sent: states would only be older when it does.
  virtual bool is_behind(PageId page) const = 0;
};

struct SiteOptions {
  std::string version{};
  std::vector<DaemonName> daemons{};  // with the next ones at least one, names differ
  std::vector<RemoteName> remotes{};
  AccessOptions access{};
  std::string tokens{};   // path
  std::string folder{};   // of the page
  std::string bushctl{};  // path
};

class Site {
 public:
  // Pages are told what is new one fifth after the other: browsers that have many open would draw
  // all of them at the same moment, and a key that is pressed just then would wait for that.
  static constexpr int kTurns = 5;
  static constexpr int kTicksPerSecond = 10 * kTurns;

  Site(SiteOptions options, Poller& poller, Outlet& outlet, Dialer& dialer);
  ~Site();
  Site(const Site&) = delete;
  Site& operator=(const Site&) = delete;

  // To anything but a WebSocket.
  Answer answer(const Visit& visit);
  // Why there is to be no WebSocket; "": there may.
  std::string why_no_page(const Visit& visit) const;
  // It comes from this PC, or has a token: places are kept for it.
  bool is_preferred(const Visit& visit) const;
  void open(PageId page, const Visit& visit);
  void hear(PageId page, std::string_view text);
  void close(PageId page);

  // So many times a second: a fifth of the pages is told what is new; each fifth time daemons are
  // tried again, and once a second tokens are read.
  void tick();

 private:
  class OpenPage;

  Answer log_in(const Visit& visit);
  Answer log_out(const Visit& visit);
  Answer cookie(int status, const std::string& token, std::int64_t seconds) const;
  Answer state(const Visit& visit);
  Answer metrics();
  Answer file(const Visit& visit) const;
  bool may_fail_again(const std::string& peer, std::int64_t now_us);
  Rights rights_for(const Visit& visit) const;
  Source* source_of(const std::string& daemon) const;
  void catch_up(OpenPage& page);
  void take_news();
  void tell_news(OpenPage& page, const Text& still_here);
  void refresh_tokens();
  void check_rights();
  bool is_heard(Source& source);
  void run_doctor(Source& source, PageId page, std::int64_t id);
  void end_examinations();
  void tell_findings(std::string daemon, const bushd::Result<std::string>& output);

  SiteOptions options_;
  Poller& poller_;
  Outlet& outlet_;
  bushd::Result<Content> content_;
  TokenFile tokens_;
  std::vector<std::unique_ptr<Source>> sources_{};
  std::map<PageId, std::unique_ptr<OpenPage>> pages_;
  // How many more wrong tokens are taken from an address just now.
  struct Failures {
    double left;
    std::int64_t at_us;
  };
  std::map<std::string, Failures> failures_{};
  // Who waits for which daemon's doctor, which runs once for all of them.
  struct Examination {
    std::unique_ptr<ProgramRun> run;
    std::vector<std::pair<PageId, std::int64_t>> waiting{};
    std::int64_t since_us = 0;
  };
  std::map<std::string, Examination> examinations_{};
  std::map<std::string, std::int64_t> heard_at_us_{};  // of each daemon's last state
  int ticks_ = 0;                                      // of this second
  std::vector<Text> news_{};                           // of the last round through all pages
  std::int64_t round_ = 0;
};

}  // namespace bushweb

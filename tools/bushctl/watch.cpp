// Live view: in a terminal a table that is drawn anew, elsewhere a line for every motor that has
// changed.
#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "base/printable.h"
#include "commands.h"
#include "render.h"
#include "screen.h"

namespace bushctl {
namespace {

using bushd::lcm::Snapshot;

class View {
 public:
  virtual ~View() = default;
  virtual void show(const Snapshot& snapshot) = 0;
  // No snapshot came in time. Whether to go on waiting.
  virtual bool silent() = 0;
};

class ChangesView : public View {
 public:
  void show(const Snapshot& snapshot) override {
    for (const bushd::state_t& mcu : snapshot.mcus) {
      line(mcu.mcu, fmt::format("{} {} boot {}{}{}", bushd::printable(mcu.mcu),
                                bushd::printable(mcu.mcu_state), mcu.boot_number,
                                mcu.detail.empty() ? "" : " ", bushd::printable(mcu.detail)));
      for (const bushd::motor_state_t& motor : mcu.motors) line(motor.name, motor_line(motor));
    }
    std::fflush(stdout);
  }
  bool silent() override { return false; }

 private:
  void line(const std::string& about, const std::string& text) {
    std::string& last = shown_[about];
    if (last == text) return;
    last = text;
    fmt::print("{}\n", text);
  }

  std::map<std::string, std::string> shown_;  // last line by motor or MCU
};

class TerminalView : public View {
 public:
  void show(const Snapshot& snapshot) override { screen_.show(table(snapshot)); }
  bool silent() override {
    screen_.notice("no state from bushd; what is shown is old");
    return true;
  }

 private:
  Screen screen_{"'bushctl status' shows all"};
};

}  // namespace

int watch(bushd::lcm::Client& client, const WatchOptions& options) {
  // Before the terminal is touched: without a daemon the message belongs on the first screen.
  auto snapshot = client.snapshot(options.timeout);
  if (!snapshot) return failure(client, snapshot.error());
  std::unique_ptr<View> view;
  if (isatty(STDOUT_FILENO) != 0) {
    view = std::make_unique<TerminalView>();
  } else {
    view = std::make_unique<ChangesView>();
  }
  for (unsigned shown = 0;;) {
    if (snapshot) {
      view->show(*snapshot);
      if (options.count && ++shown >= *options.count) return kDone;
    } else if (client.interrupted()) {
      return kDone;
    } else if (!view->silent()) {
      return failure(client, snapshot.error());
    }
    snapshot = client.snapshot(options.timeout);
  }
}

}  // namespace bushctl

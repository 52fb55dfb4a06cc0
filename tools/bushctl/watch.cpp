#include "watch.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "base/printable.h"
#include "commands.h"
#include "render.h"
#include "screen.h"

namespace bushctl {
namespace {

using bushd::client::Status;

class View {
 public:
  virtual ~View() = default;
  virtual void show(const Status& status) = 0;
  // No snapshot came in time. Whether to go on waiting.
  virtual bool silent() = 0;
  // What has been shown is not all that there was to show.
  virtual void warn(const std::string& text) = 0;
};

class ChangesView : public View {
 public:
  void show(const Status& status) override {
    for (std::size_t i = 0; i < status.states.size(); ++i) {
      const bushd::api::StateSnapshot& mcu = status.states[i].snapshot;
      if (status.descriptions.at(i).snapshot.is_mcu()) {
        line(mcu.mcu,
             fmt::format("{} {} boot {}{}{}", bushd::printable(mcu.mcu), word(mcu.state), mcu.boot,
                         mcu.detail.empty() ? "" : " ", bushd::printable(mcu.detail)));
      }
      for (std::size_t m = 0; m < mcu.motors.size(); ++m) {
        line(mcu.motors[m].name, motor_line(status, i, m));
      }
    }
    std::fflush(stdout);
  }
  bool silent() override { return false; }
  void warn(const std::string& text) override { fmt::print(stderr, "bushctl: {}\n", text); }

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
  void show(const Status& status) override { screen_.show(table(status)); }
  bool silent() override {
    screen_.notice("no state from bushd; what is shown is old");
    return true;
  }
  void warn(const std::string& text) override { screen_.notice(text); }

 private:
  Screen screen_{"'bushctl status' shows all"};
};

}  // namespace

int watch(bushd::client::Client& client, const WatchOptions& options) {
  // Before the terminal is touched: without a daemon the message belongs on the first screen.
  auto status = client.status(options.timeout);
  if (!status) return failure(client, status.error());
  std::unique_ptr<View> view;
  if (isatty(STDOUT_FILENO) != 0) {
    view = std::make_unique<TerminalView>();
  } else {
    view = std::make_unique<ChangesView>();
  }
  std::uint64_t lost = 0;
  for (unsigned shown = 0;;) {
    if (status) {
      view->show(*status);
      if (status->missing_mcus.count > 0) {
        view->warn(missing_text(status->answered, status->missing_mcus, "MCUs"));
      }
      if (status->lost > lost) view->warn(lost_text(status->lost - lost));
      lost = status->lost;
      if (options.count > 0 && ++shown >= options.count) return kDone;
    } else if (client.interrupted()) {
      return kDone;
    } else if (client.ended() || !view->silent()) {
      view.reset();
      return failure(client, status.error());
    }
    status = client.next_state(options.timeout);
  }
}

}  // namespace bushctl

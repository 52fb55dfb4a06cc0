#include "watch.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "api/name_pattern.h"
#include "base/printable.h"
#include "commands.h"
#include "live.h"
#include "motor_cells.h"
#include "named_motors.h"
#include "render.h"
#include "screen.h"
#include "watch_table.h"

namespace bushctl {
namespace {

using bushd::client::Client;
using bushd::client::Status;

// What has been shown is not all that there was to show; "": it is.
class Losses {
 public:
  std::string text_of(const Status& status) {
    const std::uint64_t lost = status.lost - std::min(status.lost, lost_);
    lost_ = status.lost;
    if (status.missing_mcus.count > 0) {
      return missing_text(status.answered, status.missing_mcus, "MCUs");
    }
    return lost > 0 ? lost_text(lost) : "";
  }

 private:
  std::uint64_t lost_ = 0;
};

class Changes {
 public:
  explicit Changes(const std::vector<std::string>& names) : names_(names) {}

  void show(const Status& status) {
    for (std::size_t i = 0; i < status.states.size(); ++i) {
      const bushd::api::StateSnapshot& mcu = status.states[i].snapshot;
      const bushd::api::Description& description = status.descriptions.at(i).snapshot;
      if (description.is_mcu()) {
        line(mcu.mcu,
             fmt::format("{} {} boot {}{}{}", bushd::printable(mcu.mcu), word(mcu.state), mcu.boot,
                         about(mcu).empty() ? "" : " ", bushd::printable(about(mcu))));
      }
      for (std::size_t m = 0; m < mcu.motors.size(); ++m) {
        const std::string& name = mcu.motors[m].name;
        if (!bushd::api::names_motor(names_, name, description_of(description, m, name).group))
          continue;
        line(name, motor_line(status, i, m));
      }
    }
    std::fflush(stdout);
  }

 private:
  void line(const std::string& about, const std::string& text) {
    std::string& last = shown_[about];
    if (last == text) return;
    last = text;
    fmt::print("{}\n", text);
  }

  const std::vector<std::string>& names_;
  std::map<std::string, std::string> shown_;  // last line by motor or MCU
};

// A name that stands for no motor ends it at the first status.
int follow(const Connection& connection, const WatchOptions& options, Live live) {
  std::optional<bushd::Error> unknown;
  live.show = [&, show = std::move(live.show), first = true](const Status& status) mutable {
    if (std::exchange(first, false)) {
      if (auto named = only(status, options.names); !named) {
        unknown = named.error();
        return false;
      }
    }
    return show(status);
  };
  const int code = follow_live(connection, live);
  return unknown ? failed(*unknown) : code;
}

int watch_changes(const Connection& connection, const WatchOptions& options) {
  Changes changes(options.names);
  Losses losses;
  unsigned shown = 0;
  std::string trouble;
  const auto tell = [&](const std::string& text) {
    if (!text.empty() && text != trouble)
      fmt::print(stderr, "bushctl: {}\n", bushd::printable(text));
    trouble = text;
  };
  return follow(connection, options,
                {.timeout = options.timeout,
                 .next = &Client::next_state_or_input,
                 .show =
                     [&](const Status& status) {
                       changes.show(status);
                       tell(losses.text_of(status));
                       return options.count == 0 || ++shown < options.count;
                     },
                 .on_input = [] { return true; },
                 .on_trouble = tell,
                 .close = [] {}});
}

int watch_screen(const Connection& connection, const WatchOptions& options) {
  std::optional<Screen> screen;
  WatchTable table(options.names);
  Status newest;
  Losses losses;
  unsigned shown = 0;
  const auto draw = [&](const std::string& notice) {
    const Screen::Size size = Screen::size();
    screen->show(table.lines(newest, size.columns, size.rows, notice));
  };
  return follow(
      connection, options,
      {.timeout = options.timeout,
       .for_ever = true,
       .next = &Client::next_state_or_input,
       .show =
           [&](const Status& status) {
             if (!screen) screen.emplace();
             newest = status;
             draw(losses.text_of(status));
             return options.count == 0 || ++shown < options.count;
           },
       .on_input =
           [&] {
             const auto keys = screen ? screen->keys() : "";
             const bool goes_on = keys && table.take_keys(*keys);
             if (screen && goes_on) draw("");
             return goes_on;
           },
       .input_fd = isatty(RawTerminal::fd()) != 0 ? RawTerminal::fd() : -1,
       .on_trouble =
           [&](const std::string& why) { draw("what is shown is old: " + bushd::printable(why)); },
       .close = [&] { screen.reset(); }});
}

}  // namespace

int watch(const Connection& connection, const WatchOptions& options) {
  return (isatty(STDOUT_FILENO) != 0 ? watch_screen : watch_changes)(connection, options);
}

}  // namespace bushctl

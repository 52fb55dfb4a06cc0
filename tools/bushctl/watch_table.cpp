#include "watch_table.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>

#include "api/name_pattern.h"
#include "base/printable.h"
#include "motor_cells.h"

namespace bushctl {
namespace {

namespace api = bushd::api;
using bushd::client::Status;

constexpr std::size_t kMostMcus = 3;  // that do not work, by name
constexpr const char* kKeys = "n/p page  / filter  o order  q ends";

bool works(const api::StateSnapshot& mcu) {
  return mcu.state == api::McuState::kReady || mcu.state == api::McuState::kRunning;
}

std::string counted(std::size_t count, const char* one) {
  return fmt::format("{} {}{}", count, one, count == 1 ? "" : "s");
}

// "2 FAULT, 1 OFFLINE".
std::string states_of_mcus(const Status& status) {
  std::map<std::string, std::size_t> states;
  for (std::size_t i = 0; i < status.states.size(); ++i) {
    const api::StateSnapshot& mcu = status.states[i].snapshot;
    if (status.descriptions.at(i).snapshot.is_mcu() && !works(mcu)) {
      ++states[std::string(word(mcu.state))];
    }
  }
  std::vector<std::string> texts;
  for (const auto& [state, count] : states) texts.push_back(fmt::format("{} {}", count, state));
  return texts.empty() ? "all work" : fmt::format("{}", fmt::join(texts, ", "));
}

std::vector<std::string> mcus_that_do_not_work(const Status& status) {
  std::vector<std::string> out;
  std::size_t more = 0;
  for (std::size_t i = 0; i < status.states.size(); ++i) {
    const api::StateSnapshot& mcu = status.states[i].snapshot;
    if (!status.descriptions.at(i).snapshot.is_mcu() || works(mcu)) continue;
    if (out.size() == kMostMcus) {
      ++more;
    } else {
      out.push_back(fmt::format("{} {}{}{}", bushd::printable(mcu.mcu), word(mcu.state),
                                mcu.detail.empty() ? "" : ": ", bushd::printable(mcu.detail)));
    }
  }
  if (more > 0) out.back() += fmt::format("; and {} more", more);
  return out;
}

// What there is room for. From the widest to the narrowest.
constexpr std::array<MotorColumns, 5> kLayouts = {
    {{true, 15, true}, {false, 15, true}, {false, 7, true}, {false, 3, true}, {false, 3, false}}};

}  // namespace

struct WatchTable::Row {
  const api::MotorState* motor;
  api::MotorDescription description;
  const api::StateSnapshot* mcu;
  bool of_mcu;

  // What comes first. On a bench without a state store all positions are uncertain: what does not
  // work comes before those.
  int rank() const {
    if (motor->moving) return 0;
    if ((of_mcu && !works(*mcu)) || motor->inhibited.any()) return 1;
    return motor->trust == api::Trust::kKnown ? 3 : 2;
  }
};

namespace {

std::size_t widest(const std::vector<std::string>& lines) {
  std::size_t most = 0;
  for (const std::string& line : lines) most = std::max(most, line.size());
  return most;
}

}  // namespace

bool WatchTable::take_keys(std::string_view bytes) {
  while (!bytes.empty()) {
    // A key of several bytes: ESC [ and up to its letter or ~. ESC by itself is a key too.
    std::size_t size = 1;
    if (bytes.starts_with("\x1b[")) {
      const auto end = bytes.find_first_not_of("0123456789;", 2);
      size = end == std::string_view::npos ? bytes.size() : end + 1;
    }
    const std::string_view key = bytes.substr(0, size);
    typing_ ? type(key) : take_key(key);
    bytes.remove_prefix(size);
  }
  return goes_on_;
}

void WatchTable::take_key(std::string_view key) {
  if (key == "q") goes_on_ = false;
  if (key == "n" || key == " " || key == "\x1b[6~" || key == "\x1b[B") ++page_;
  if ((key == "p" || key == "b" || key == "\x1b[5~" || key == "\x1b[A") && page_ > 0) --page_;
  if (key == "g" || key == "\x1b[H") page_ = 0;
  if (key == "o") as_configured_ = !as_configured_;
  if (key == "\x1b") filter_.clear();
  if (key == "/") {
    typing_ = true;
    filter_.clear();
  }
  if (key == "/" || key == "o" || key == "\x1b") page_ = 0;
}

void WatchTable::type(std::string_view key) {
  if (key == "\r" || key == "\n") typing_ = false;
  if (key == "\x1b") {
    typing_ = false;
    filter_.clear();
  }
  if ((key == "\x7f" || key == "\b") && !filter_.empty()) filter_.pop_back();
  if (key.size() == 1 && key[0] > ' ' && key[0] < '\x7f') filter_ += key;
  page_ = 0;
}

bool WatchTable::is_shown(const Row& row) const {
  const std::string& group = row.description.group;
  if (!api::names_motor(names_, row.motor->name, group)) return false;
  if (filter_.empty()) return true;
  if (api::is_name_pattern(filter_)) return api::names_motor(filter_, row.motor->name, group);
  return row.motor->name.find(filter_) != std::string::npos ||
         group.find(filter_) != std::string::npos ||
         row.mcu->mcu.find(filter_) != std::string::npos;
}

std::vector<WatchTable::Row> WatchTable::rows_of(const Status& status) const {
  std::vector<Row> rows;
  for (std::size_t i = 0; i < status.states.size(); ++i) {
    const api::StateSnapshot& mcu = status.states[i].snapshot;
    const api::Description& description = status.descriptions.at(i).snapshot;
    for (std::size_t m = 0; m < mcu.motors.size(); ++m) {
      Row row{.motor = &mcu.motors[m],
              .description = description_of(description, m, mcu.motors[m].name),
              .mcu = &mcu,
              .of_mcu = description.is_mcu()};
      if (is_shown(row)) rows.push_back(std::move(row));
    }
  }
  if (!as_configured_) std::ranges::stable_sort(rows, {}, &Row::rank);
  return rows;
}

std::string WatchTable::summary(const Status& status, std::size_t shown) const {
  std::size_t motors = 0;
  std::size_t moving = 0;
  std::size_t mcus = 0;
  for (std::size_t i = 0; i < status.states.size(); ++i) {
    const bool is_mcu = status.descriptions.at(i).snapshot.is_mcu();
    mcus += is_mcu ? 1 : 0;
    for (const api::MotorState& motor : status.states[i].snapshot.motors) {
      ++motors;
      moving += motor.moving ? 1 : 0;
    }
  }
  std::string text = fmt::format("{}, {} moving; {}, {}", counted(motors, "motor"), moving,
                                 counted(mcus, "MCU"), states_of_mcus(status));
  if (shown < motors) text += fmt::format("; {} shown", shown);
  return text;
}

std::string WatchTable::last_line(std::size_t pages) const {
  if (typing_) {
    return fmt::format("show (part of a name, group or MCU; slit*, @group): {}_", filter_);
  }
  std::string text = pages > 1 ? fmt::format("page {} of {}  ", page_ + 1, pages) : "";
  text += kKeys;
  if (!filter_.empty()) text += fmt::format("  shows {} (Esc: all)", filter_);
  return text;
}

std::vector<std::string> WatchTable::lines(const Status& status, std::size_t columns,
                                           std::size_t rows, const std::string& notice) {
  const std::vector<Row> all = rows_of(status);
  std::vector<std::string> out{summary(status, all.size())};
  for (std::string& mcu : mcus_that_do_not_work(status)) out.push_back(std::move(mcu));
  const std::size_t taken = out.size() + 2;  // the heading and the keys
  const std::size_t room = rows > taken ? rows - taken : 1;
  const std::size_t pages = std::max<std::size_t>((all.size() + room - 1) / room, 1);
  page_ = std::min(page_, pages - 1);
  const std::size_t first = std::min(page_ * room, all.size());
  const std::size_t last = std::min(first + room, all.size());
  std::vector<std::string> shown;
  for (const MotorColumns& layout : kLayouts) {
    // All motors are in it, so that the columns stay where they are from page to page; their notes
    // are not, as they may be as long as they like.
    Grid fitted = motor_grid(layout);
    Grid grid = fitted;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Row& row = all[i];
      auto texts = motor_row(*row.motor, row.description, *row.mcu, row.of_mcu, layout);
      if (i >= first && i < last) grid.row(texts);
      texts.back().clear();
      fitted.row(std::move(texts));
    }
    shown = grid.lines();
    if (widest(fitted.lines()) <= columns) break;
  }
  out.insert(out.end(), shown.begin(), shown.end());
  out.push_back(notice.empty() ? last_line(pages) : notice);
  return out;
}

}  // namespace bushctl

// A terminal taken over for a full-screen program; it is as it was when this object goes, whatever
// the reason.
#pragma once

#include <deque>
#include <memory>

#include "base/result.h"
#include "editor_view.h"
#include "key.h"

namespace bushtab {

class Terminal {
 public:
  // Whether standard input and output are a terminal.
  static bool is_there();
  // Refused if it cannot be drawn on. One at a time.
  static bushd::Result<std::unique_ptr<Terminal>> open();
  ~Terminal();
  Terminal(const Terminal&) = delete;
  Terminal& operator=(const Terminal&) = delete;

  Window window() const;
  void draw(const CellGrid& grid);

  enum class Event { kKey, kResized, kInterrupted, kGone };
  struct Input {
    Event event = Event::kKey;
    Key key = key::kEscape;
  };
  // Waits. kInterrupted: Ctrl-C. kGone: the terminal is, or somebody wants the program to end; the
  // signals that say so then stay blocked.
  Input wait();
  // wait() would not wait.
  bool key_waits() const { return !waiting_.empty(); }

 private:
  Terminal();
  Input next();
  void take_keys();
  Input take_signal();

  int signals_ = -1;
  bool unicode_ = false;
  bool coloured_ = false;
  bool gone_ = false;
  std::deque<Input> waiting_;
};

}  // namespace bushtab

// What a person asks of a motor by the keys of a terminal. Without I/O and without a clock: bytes
// come with the time at which they were read.
//
// All that was read at once counts as a whole: what stops counts before all else, a key that came
// many times is one, and what cannot be done now is forgotten. Nothing waits for later.
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

namespace bushctl {

class JogKeys {
 public:
  using Time = std::chrono::milliseconds;  // since whenever

  // A held key that is not repeated for so long was let go. Terminals repeat twice a second at
  // least; how long they take to begin with it is not known.
  static constexpr Time kLetGo{600};
  // A key that comes again sooner than anybody presses it is held.
  static constexpr Time kRepeat{150};
  // The rest of a key's sequence comes sooner; Esc is a key by itself.
  static constexpr Time kEscape{50};

  enum class Course { kRest, kLeft, kRight, kUp, kDown, kStopping };

  // All bytes that there are. Time alone changes things too, so none will do.
  void read(Time now, std::string_view bytes);
  // The program is to end: as q. Also when the terminal has gone.
  void quit();
  // The motion has ended. Unless that was `as_asked`, the key that began it begins nothing until it
  // has been let go.
  void rests(Time now, bool as_asked);

  // What the motor is to do: jog left or right, make a step up or down, stop. What has begun stays
  // until it rests.
  Course course() const { return course_; }
  bool quits() const { return quits_; }
  // By Ctrl-Z; once for each.
  bool take_suspension() { return std::exchange(suspends_, false); }
  // How often to double them since the last call; negative: to halve.
  int take_speed_change() { return std::exchange(speed_, 0); }
  int take_step_change() { return std::exchange(step_, 0); }

  // When to call read() at the latest; Time::max(): not before there are bytes.
  Time wake() const;

 private:
  enum class Key {
    kLeft,
    kRight,
    kUp,
    kDown,
    kFaster,
    kSlower,
    kLonger,
    kShorter,
    kQuit,
    kSuspend,
    kOther
  };
  static constexpr std::size_t kKeys = 11;

  class Pressed {
   public:
    void add(Key key) { ++times_[static_cast<std::size_t>(key)]; }
    int times(Key key) const { return times_[static_cast<std::size_t>(key)]; }

   private:
    std::array<int, kKeys> times_{};
  };

  std::optional<Key> take_key();
  void stop();
  void take_amounts(Time now, const Pressed& pressed);
  void take_arrows(Time now, const Pressed& pressed);
  void take_arrow(Time now, Course arrow, bool repeated);

  std::string bytes_;  // those of a key that has not come whole, at the end
  Time bytes_at_{};    // the last of them
  Course course_ = Course::kRest;
  Course begun_ = Course::kRest;  // by the last arrow that has begun anything
  Time arrow_at_{};               // it came last
  bool held_ = false;             // it has been repeated
  bool barred_ = false;           // it begins nothing until it is let go
  std::optional<Key> amount_;     // the last one of speed and step
  Time amount_at_{};
  int speed_ = 0;
  int step_ = 0;
  bool quits_ = false;
  bool suspends_ = false;
};

}  // namespace bushctl

// The time of a line whose motors are at ports of their own, each of which makes the line's run by
// itself: serial ports that make pulses (lib/heritage/serial_pulse). Their bytes leave when they
// leave, and nobody can push one of them. So the run's time is that of the slowest port. Each tells
// how late it is as soon as it knows, and none writes a step before the run's time has come to it.
//
//     due(t) = begun + t       t: time of the run at which a step falls, from the run's beginning
//
// `begun` is moved on when a port cannot make a step by due(t) + kLateNs. A port that is behind the
// driver's queue already goes on until it is kAheadNs before its time: waiting drains the line, and
// its motor feels that.
//
// So what one port is ahead of another one, in time of the run, is at most
//
//     kLateNs + kAheadNs + what it had under way when the other one became late
//                        + what the other one's port had not yet told.
//
// How much it is, measure() says by the bytes that have left. Nothing here looks at a clock.
// Not thread-safe: its ports belong to one core.
#pragma once

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

namespace bushd::link {

// Where a port is in the time of the run: at or behind its last step, and not yet at its next one.
struct RunProgress {
  std::int64_t from_ns;
  std::int64_t to_ns;  // INT64_MAX: it has made its last one
};

class LinePort {
 public:
  virtual ~LinePort() = default;
  // By what is known of its bytes. Precondition: it has a place on a line that has begun.
  virtual RunProgress progress_at(std::int64_t now_ns) const = 0;
};

class LinePace {
 public:
  static constexpr std::int64_t kLateNs = 500'000;
  static constexpr std::int64_t kAheadNs = 1'000'000;
  // From when all are ready to the beginning: each asks once in kAskUs.
  static constexpr std::int64_t kAskUs = 1'000;
  static constexpr std::int64_t kStartNs = 3'000'000;

  // `ports` of them will each have a Place. `most_ahead_ns`: of the line's runs before.
  explicit LinePace(unsigned ports, std::int64_t most_ahead_ns = 0)
      : unready_(ports), most_ahead_ns_(most_ahead_ns) {}

  // The most that a port may have been ahead of another one, in time of the run, between looks too.
  std::int64_t most_ahead_ns() const { return most_ahead_ns_; }

  // A port's place on the line. It leaves with this: then nobody waits for it.
  class Place {
   public:
    explicit Place(std::shared_ptr<LinePace> pace) : pace_(std::move(pace)) {}
    Place(Place&&) = default;
    Place& operator=(Place&&) = delete;
    ~Place() {
      if (!pace_) return;
      if (!ready_) --pace_->unready_;
      std::erase(pace_->ports_, port_);
    }
    // Whose place it is; it outlives this.
    void give_to(const LinePort* port) {
      port_ = port;
      pace_->ports_.push_back(port);
    }

    // It could make its first step at once. Returns whether the run has a beginning: all can.
    bool ready(std::int64_t now_ns) {
      if (!ready_) --pace_->unready_;
      ready_ = true;
      if (!pace_->begun_ns_ && pace_->unready_ == 0) pace_->begun_ns_ = now_ns + kStartNs;
      return begun();
    }
    bool begun() const { return ready_ && pace_->begun_ns_.has_value(); }

    // The others are asked once begun() only.
    std::int64_t due_ns(std::int64_t run_ns) const { return *pace_->begun_ns_ + run_ns; }
    std::int64_t run_ns(std::int64_t now_ns) const { return now_ns - *pace_->begun_ns_; }
    // Its step of that time of the run cannot be before `earliest_ns`.
    void cannot_be_before(std::int64_t earliest_ns, std::int64_t run_ns) {
      pace_->begun_ns_ = std::max(*pace_->begun_ns_, earliest_ns - run_ns - kLateNs);
    }
    // How far the port is ahead of the slowest one now. What they were apart since the look before
    // counts as well: the slowest has not gone back since.
    std::int64_t measure(std::int64_t now_ns) {
      std::int64_t slowest_ns = INT64_MAX;
      std::int64_t fastest_ns = 0;
      for (const LinePort* port : pace_->ports_) {
        const RunProgress progress = port->progress_at(now_ns);
        slowest_ns = std::min(slowest_ns, progress.to_ns);
        fastest_ns = std::max(fastest_ns, progress.from_ns);
      }
      pace_->most_ahead_ns_ = std::max(pace_->most_ahead_ns_, fastest_ns - pace_->slowest_ns_);
      pace_->slowest_ns_ = slowest_ns;
      return std::max<std::int64_t>(port_->progress_at(now_ns).from_ns - slowest_ns, 0);
    }
    std::int64_t most_ahead_ns() const { return pace_->most_ahead_ns_; }

   private:
    std::shared_ptr<LinePace> pace_;
    const LinePort* port_ = nullptr;
    bool ready_ = false;
  };

 private:
  unsigned unready_;
  std::vector<const LinePort*> ports_;
  std::optional<std::int64_t> begun_ns_;
  std::int64_t slowest_ns_ = 0;  // at the last look
  std::int64_t most_ahead_ns_;
};

}  // namespace bushd::link

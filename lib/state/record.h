// What outlives the daemon and the power: where motors stand, how good that is, what was set in
// operation, and what has moved them.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace bushd::state {

// How far a kept position can be relied on.
enum class Trust {
  kUnconfirmed,  // nobody has said where the motor stands; as far as that goes no step is lost
  kKnown,
  kRestored,  // as it was when the power went; nobody has looked since
  kUncertain  // steps may be lost
};

// Where a motor stands, or was seen last.
struct Record {
  std::int64_t steps = 0;
  std::string steps_per_unit{};  // exact text, as it was then; "" without units
  Trust trust = Trust::kUnconfirmed;
  std::string reason{};  // of kUncertain
  std::int64_t utime_us = 0;
  // Where it was told to go last, if that is no whole number of steps: what is beyond
  // `target_steps`, in 2^-32 of a step; 0: nothing.
  std::int64_t target_steps = 0;
  std::int64_t target_parts = 0;
  // Whose counter these steps are; "": of none.
  std::string unique_id{};
  std::uint16_t boot_number = 0;
  std::uint8_t output = 0;
  // The motor stood, and `motion` is the number of the last motion that had ended by then.
  bool at_rest = false;
  std::uint64_t motion = 0;
  friend bool operator==(const Record&, const Record&) = default;
};

// A position belongs to an output of an MCU: to its counter of steps.
inline bool same_counter(const Record& a, const Record& b) {
  return a.unique_id == b.unique_id && a.output == b.output;
}

// Its output has become that of this motor: where it stands itself nobody knows any more. It has no
// counter then.
void give_up_output(Record& record, const std::string& to);

// What was set in operation in place of a key of bushd.toml: it counts until that is edited.
struct Setting {
  std::string value{};
  // Its line of the file, "offset = 0"; "" if it was left out. Of stores older than that, the value
  // that counted, "0".
  std::string replaces{};
  friend bool operator==(const Setting&, const Setting&) = default;
};
using Settings = std::map<std::string, Setting>;  // by key: offset, direction, soft_limits, held

// The key of a motor that is held; its value says by whom and since when, for people.
inline constexpr const char* kHeldKey = "held";

// Names with a slash are of something else that has settings: no motor has one.
inline bool is_no_motor(const std::string& name) {
  return name.find('/') != std::string::npos;
}

// All that is kept of one motor.
struct Kept {
  std::optional<Record> record{};
  // The number of the last motion that may have begun. Another one than the record's: the motor
  // moved when the power went, as far as the disk knows.
  std::uint64_t motion = 0;
  bool mark_lost = false;  // `motion` is not as it was written, but of one that may have been
  Settings settings{};
};

inline bool stood(const Kept& kept) {
  return kept.record && kept.record->at_rest && kept.record->motion == kept.motion;
}

// A line of a motor's history.
struct PastMove {
  std::string motor{};
  std::int64_t utime_us = 0;  // when it ended
  std::string what{};         // move, home, arm, jog, set, config, confirm
  std::string who{};
  std::int64_t from_steps = 0;
  std::int64_t to_steps = 0;
  std::string result{};
  std::string reason{};
  // Both as people saw them then, "3.0000 mm"; "" of a motor without a unit.
  std::string from_text{};
  std::string to_text{};
  friend bool operator==(const PastMove&, const PastMove&) = default;
};

// What is written at once or not at all.
struct Batch {
  std::map<std::string, Record> records{};     // by motor
  std::map<std::string, Settings> settings{};  // all that the motor has
  std::vector<PastMove> moves{};
  bool empty() const { return records.empty() && settings.empty() && moves.empty(); }
};

// A motion is about to begin.
struct Mark {
  std::string motor{};
  std::uint64_t motion = 0;
  friend bool operator==(const Mark&, const Mark&) = default;
};

}  // namespace bushd::state

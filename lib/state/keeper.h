// What is to be on the disk, what is there, and what is on the way: the side of the store that has
// no disk of its own. Marks and writes go to a backend in another thread, and its answers are
// inputs like any other; so simulations run it in virtual time.
//
// At most one request of each kind is under way. What comes meanwhile goes together in the next, so
// that many motors that start at once cost one sync. Marks and writes need no order between them:
// a record carries the number of the motion whose end it knows.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/by_id.h"
#include "base/ids.h"
#include "base/result.h"
#include "state/record.h"
#include "state/rules.h"

namespace bushd::state {

// Where the disk is. mark() and write() are answered by Keeper's functions of these names, later.
class Backend {
 public:
  virtual ~Backend() = default;
  virtual void mark(std::vector<Mark> marks) = 0;
  virtual void write(Batch batch) = 0;
  using Told = std::function<void(const Result<std::vector<PastMove>>&)>;
  virtual void history(std::string motor, int most, Told told) = 0;
};

class Keeper {
 public:
  static constexpr std::int64_t kPatienceUs = 1'000'000;
  static constexpr std::int64_t kRetryUs = 1'000'000;
  static constexpr int kMaxPendingMoves = 10'000;  // while the disk does not take any

  // `kept`: as the store was when it was opened. The backend outlives it.
  Keeper(const std::vector<std::string>& motors, const std::map<std::string, Kept>& kept,
         Backend& backend);

  // As it is now, for the rules on connecting.
  const Kept& kept(MotorId motor) const { return motors_[motor].kept; }
  // The motor, other than this one, whose position is the counter of this output.
  std::optional<Owner> other_at(MotorId motor, const std::string& unique_id,
                                std::uint8_t output) const;

  // Whatever happens now, this motor does not look at rest when the power goes, and no other motor
  // has the counter that it moves by.
  bool marked(MotorId motor) const;
  // Makes it so, which takes a moment, or says why that does not come to pass.
  Result<void> want_mark(std::int64_t now_us, MotorId motor);
  // It moves without. Until its rest is on the disk again, it does not look at rest.
  void give_up_mark(MotorId motor);
  bool any_unguarded() const;

  // It stands, by a report after its motion. The record's `at_rest` and `motion` are filled in.
  // Not to be told while somebody wants its mark.
  void stands(MotorId motor, Record record);
  // It was seen in motion.
  void moves(MotorId motor, Record record);
  void settings(MotorId motor, Settings settings);
  // The settings of what is no motor.
  void settings(const std::string& name, Settings settings);
  // While the disk does not take them, the newest are kept.
  void past(PastMove move);

  // How much has been told, and how much of that is on the disk.
  std::uint64_t told() const { return told_; }
  std::uint64_t kept_up_to() const { return kept_up_to_; }
  // Why the last write failed; nothing while writes succeed.
  const std::optional<std::string>& trouble() const { return trouble_; }

  // Hands out what is due.
  void step(std::int64_t now_us);
  std::int64_t next_wake_us() const;

  // Answers.
  void mark(std::int64_t now_us, const Result<void>& done);
  void write(std::int64_t now_us, const Result<void>& done);

 private:
  struct Motor {
    std::string name;
    Kept kept;
    std::uint64_t on_disk = 0;  // number of the last motion whose mark is there
    // Number of the last motion of whose end the disk may know.
    std::uint64_t ended = 0;
    bool unguarded = false;
    bool present = false;                     // told of, since this began
    std::optional<std::int64_t> wanted_us{};  // since when its mark is wanted and not there
    std::optional<Record> record_on_disk{};
    std::optional<std::int64_t> record_wanted_us{};  // since when it is, and of another counter
  };
  static bool has_mark(const Motor& motor);
  static bool has_counter(const Motor& motor);
  Result<void> want_counter(std::int64_t now_us, Motor& motor);
  void tell(Motor& motor, Record record);
  void take_output(Motor& motor, const Record& record);

  Backend& backend_;
  ById<MotorId, Motor> motors_;
  std::map<std::string, Record> others_;  // of motors that are not configured now
  std::vector<MotorId> to_mark_;
  std::vector<std::pair<MotorId, std::uint64_t>> marking_;  // under way
  std::optional<std::string> mark_error_;
  std::int64_t mark_again_us_ = 0;
  Batch pending_;
  std::optional<Batch> writing_;  // under way
  std::uint64_t told_ = 0;
  std::uint64_t writing_up_to_ = 0;
  std::uint64_t kept_up_to_ = 0;
  std::optional<std::string> trouble_;
  std::int64_t write_again_us_ = 0;
};

}  // namespace bushd::state

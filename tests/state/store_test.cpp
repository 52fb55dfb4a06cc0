#include "state/store.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "sim/disk/sim_disk.h"
#include "state/rules.h"

namespace bushd::state::store_test {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::SizeIs;

constexpr const char* kDatabase = "/state/state.db";
constexpr const char* kMarks = "/state/moving.marks";

Record standing_at(std::int64_t steps, std::uint64_t motion) {
  return {.steps = steps,
          .steps_per_unit = "400",
          .trust = Trust::kKnown,
          .utime_us = 1'000'000,
          .unique_id = "0123456789abcdef",
          .boot_number = 7,
          .output = 2,
          .at_rest = true,
          .motion = motion};
}

Opening an_opening(std::vector<std::string> motors = {"phi", "theta"}) {
  return {.folder = "/state", .motors = std::move(motors), .utime_us = 5'000'000, .random = 42};
}

Store open(sim::SimDisk& disk, const Opening& opening = an_opening()) {
  auto store = Store::open(disk, opening);
  if (!store) throw std::runtime_error(store.error().text());
  return std::move(*store);
}

PastMove past_move(const std::string& motor, std::int64_t utime_us) {
  return {.motor = motor,
          .utime_us = utime_us,
          .what = "move",
          .who = "command 1 of bushctl-1",
          .from_steps = 0,
          .to_steps = 10,
          .result = "reached",
          .reason = "stands at its target"};
}

TEST(Store, KeepsWhatWasWritten) {
  sim::SimDisk disk(1);
  {
    Store store = open(disk);
    EXPECT_THAT(store.notes(), IsEmpty());
    EXPECT_FALSE(store.kept().at("theta").record);
    ASSERT_TRUE(store.mark({{"theta", 1}}));
    ASSERT_TRUE(store.write({.records = {{"theta", standing_at(1200, 1)}},
                             .settings = {{"theta", {{"offset", {"1.5", "0"}}}}},
                             .moves = {past_move("theta", 7)}}));
  }
  disk.boot();
  Store store = open(disk);
  const Kept& kept = store.kept().at("theta");
  EXPECT_EQ(kept.record, standing_at(1200, 1));
  EXPECT_TRUE(stood(kept));
  EXPECT_EQ(kept.settings.at("offset"), (Setting{"1.5", "0"}));
  EXPECT_THAT(*store.history("theta", 10), ElementsAre(past_move("theta", 7)));
  EXPECT_THAT(*store.history("phi", 10), IsEmpty());
}

TEST(Store, KeepsSettingsOfWhatIsNoMotor) {
  sim::SimDisk disk(1);
  {
    Store store = open(disk);
    ASSERT_TRUE(store.write({.settings = {{"camac/1/5", {{"memory", {"00ff", ""}}}}}}));
  }
  disk.boot();
  EXPECT_EQ(open(disk).kept().at("camac/1/5").settings.at("memory").value, "00ff");
}

TEST(Store, AMarkBeyondTheRecordIsAMotorThatMoves) {
  sim::SimDisk disk(1);
  {
    Store store = open(disk);
    ASSERT_TRUE(store.write({.records = {{"theta", standing_at(1200, 0)}}}));
    EXPECT_TRUE(store.mark({{"theta", 1}, {"phi", 1}}));
  }
  disk.boot();
  Store store = open(disk);
  EXPECT_FALSE(stood(store.kept().at("theta")));
  EXPECT_EQ(store.kept().at("theta").motion, 1u);
}

TEST(Store, ManyMotorsThatStartAtOnceCostOneSync) {
  std::vector<std::string> motors;
  std::vector<Mark> marks;
  for (int i = 0; i < 40; ++i) {
    motors.push_back("m" + std::to_string(i));
    marks.push_back({motors.back(), 1});
  }
  sim::SimDisk disk(1);
  Store store = open(disk, an_opening(motors));
  const std::uint64_t before = disk.syncs();
  ASSERT_TRUE(store.mark(marks));
  EXPECT_EQ(disk.syncs() - before, 1u);
}

TEST(Store, MotorsThatAreNewGetSlotsAndOthersKeepTheirs) {
  sim::SimDisk disk(1);
  for (int count = 1; count < 80; count += 13) {
    std::vector<std::string> motors;
    for (int i = 0; i < count; ++i) motors.push_back("m" + std::to_string(i));
    Store store = open(disk, an_opening(motors));
    if (count > 1) {
      EXPECT_EQ(store.kept().at("m0").motion, static_cast<std::uint64_t>(count - 13));
    }
    ASSERT_TRUE(store.mark({{"m0", static_cast<std::uint64_t>(count)}, {motors.back(), 1}}));
  }
}

TEST(Store, ATornSlotCountsAsMoving) {
  sim::SimDisk disk(1);
  {
    Store store = open(disk);
    ASSERT_TRUE(store.write({.records = {{"theta", standing_at(1200, 0)}}}));
  }
  disk.content(kMarks)[2 * Marks::kSlotBytes + 72] ^= 1;
  for (int i = 0; i < 2; ++i) {  // also when it is opened again
    Store store = open(disk);
    EXPECT_FALSE(stood(store.kept().at("theta")));
  }
}

TEST(Store, MarksThatAreGoneOrOfAnotherTimeLeaveNoMotorAtRest) {
  for (const bool gone : {true, false}) {
    sim::SimDisk disk(1);
    std::vector<std::uint8_t> older;
    {
      Store store = open(disk);
      older = disk.content(kMarks);
      ASSERT_TRUE(store.mark({{"theta", 1}}));
      ASSERT_TRUE(store.write({.records = {{"theta", standing_at(1200, 1)}}}));
    }
    if (gone) {
      ASSERT_TRUE(disk.remove(kMarks));
    } else {
      disk.content(kMarks) = older;
    }
    Store store = open(disk);
    EXPECT_FALSE(stood(store.kept().at("theta")));
    EXPECT_EQ(store.notes().empty(), !gone);
  }
}

TEST(Store, AnOlderCopyOfTheDatabaseLeavesNoMotorAtRest) {
  sim::SimDisk disk(1);
  {
    Store store = open(disk);
  }
  {
    Store store = open(disk);
    ASSERT_TRUE(store.write({.records = {{"theta", standing_at(100, 0)}}}));
  }
  const std::vector<std::uint8_t> older = disk.content(kDatabase);
  {
    Store store = open(disk);
    ASSERT_TRUE(store.mark({{"theta", 1}}));
    ASSERT_TRUE(store.write({.records = {{"theta", standing_at(1200, 1)}}}));
  }
  disk.content(kDatabase) = older;
  Store store = open(disk);
  EXPECT_EQ(store.kept().at("theta").record->steps, 100);
  EXPECT_FALSE(stood(store.kept().at("theta")));
}

// Positions are gone, and nobody may take the counters of MCUs for them.
void expect_lost(const Kept& kept) {
  ASSERT_TRUE(kept.record);
  const Seen seen{.mcu = "hall:1",
                  .unique_id = "0123456789abcdef",
                  .boot_number = 7,
                  .output = 2,
                  .steps_per_unit = "400"};
  const Verdict verdict = on_connecting(kept, seen);
  EXPECT_EQ(verdict.trust, Trust::kUncertain);
  EXPECT_THAT(verdict.reason, HasSubstr("was lost"));
  EXPECT_THAT(kept.settings.at(kHeldKey).value, HasSubstr("by bushd since "));
}

TEST(Store, ADatabaseThatIsGoneIsNoticed) {
  sim::SimDisk disk(1);
  {
    Store store = open(disk);
    ASSERT_TRUE(store.mark({{"theta", 1}}));
    ASSERT_TRUE(store.write({.records = {{"theta", standing_at(1200, 1)}}}));
  }
  ASSERT_TRUE(disk.remove(kDatabase));
  for (int i = 0; i < 2; ++i) expect_lost(open(disk).kept().at("theta"));
}

TEST(Store, WhatIsNoGoodDatabaseIsMovedAsideNotDeleted) {
  const std::vector<std::string> contents{
      "hello, this is a text of somebody's that has nothing to do with positions",
      std::string("SQLite format 3\0 and then something else", 40), "damaged", "truncated"};
  for (const std::string& content : contents) {
    sim::SimDisk disk(1);
    {
      Store store = open(disk);
      ASSERT_TRUE(store.write({.records = {{"theta", standing_at(1200, 0)}}}));
    }
    std::vector<std::uint8_t>& file = disk.content(kDatabase);
    if (content == "damaged") {
      std::fill(file.begin() + 4096, file.begin() + 3 * 4096, std::uint8_t{0xA5});
    } else if (content == "truncated") {
      file.resize(file.size() - 2 * 4096);
    } else {
      file.assign(content.begin(), content.end());
    }
    const std::vector<std::uint8_t> found = file;
    Store store = open(disk);
    EXPECT_THAT(store.notes(), Contains(HasSubstr("state.db.damaged-19700101T000005"))) << content;
    EXPECT_EQ(disk.content("/state/state.db.damaged-19700101T000005"), found) << content;
    expect_lost(store.kept().at("theta"));
    expect_lost(store.kept().at("phi"));
    ASSERT_TRUE(store.write({.records = {{"theta", standing_at(5, 0)}}}));
  }
}

TEST(Store, AnEmptyFileIsADatabaseThatIsGone) {
  sim::SimDisk disk(1);
  {
    Store store = open(disk);
  }
  disk.content(kDatabase).clear();
  expect_lost(open(disk).kept().at("theta"));
}

TEST(Store, UnguardedMotionLeavesNoMotorAtRestUnlessItEndedWell) {
  for (const bool ended : {true, false}) {
    sim::SimDisk disk(1);
    {
      Opening opening = an_opening();
      opening.unguarded = true;
      Store store = open(disk, opening);
      ASSERT_TRUE(store.write({.records = {{"theta", standing_at(1200, 0)}}}));
      ASSERT_TRUE(!ended || store.end());
    }
    Store store = open(disk);
    EXPECT_EQ(stood(store.kept().at("theta")), ended);
    EXPECT_THAT(store.notes(), SizeIs(ended ? 0 : 1));
  }
}

TEST(Store, ABrokenDiskIsAnError) {
  sim::SimDisk disk(1);
  Store store = open(disk);
  disk.set_broken(true);
  EXPECT_FALSE(store.mark({{"theta", 1}}));
  EXPECT_FALSE(store.write({.records = {{"theta", standing_at(1200, 0)}}}));
  disk.set_broken(false);
  EXPECT_TRUE(store.mark({{"theta", 1}}));
  EXPECT_TRUE(store.write({.records = {{"theta", standing_at(1200, 0)}}}));
}

TEST(Database, HistoryIsBoundedInTimeAndRows) {
  sim::SimDisk disk(1);
  Store store = open(disk);
  const std::int64_t start = 10 * Database::kHistoryUs;
  Batch batch;
  for (int i = 0; i < Database::kHistoryMoves + 10; ++i) {
    batch.moves.push_back(past_move("theta", start + i));
  }
  batch.moves.push_back(past_move("phi", start));
  ASSERT_TRUE(store.write(batch));
  const auto most = store.history("theta", 10 * Database::kHistoryMoves);
  EXPECT_THAT(*most, SizeIs(Database::kHistoryMoves));
  EXPECT_EQ(most->front().utime_us, start + Database::kHistoryMoves + 9);
  EXPECT_THAT(*store.history("theta", 3), SizeIs(3));
  EXPECT_THAT(*store.history("phi", 3), SizeIs(1));
}

constexpr std::int64_t kDayUs = Database::kDayUs;
constexpr auto kDays = Database::kHistoryUs / kDayUs;

// What is old is looked for now and then.
void write_until_looked(Store& store, const char* motor, std::int64_t utime_us) {
  for (int i = 0; i < Database::kLookEvery; ++i) {
    ASSERT_TRUE(store.write({.moves = {past_move(motor, utime_us)}}));
  }
}

TEST(Database, HistoryIsBoundedInTime) {
  sim::SimDisk disk(1);
  Store store = open(disk);
  const std::int64_t start = 10 * Database::kHistoryUs;
  ASSERT_TRUE(store.write({.moves = {past_move("phi", start)}}));
  for (std::int64_t day = 1; day <= kDays; ++day) {
    ASSERT_TRUE(store.write({.moves = {past_move("theta", start + day * kDayUs)}}));
  }
  write_until_looked(store, "theta", start + kDays * kDayUs);
  EXPECT_THAT(*store.history("phi", 3), SizeIs(1)) << "90 days old, and not more";
  write_until_looked(store, "theta", start + kDays * kDayUs + 1);
  EXPECT_THAT(*store.history("phi", 3), IsEmpty());
}

// A clock that is wrong, or was, makes nothing old: a gap counts as one day at most.
TEST(Database, HistoryIsNotDeletedByAClockThatJumps) {
  sim::SimDisk disk(1);
  Store store = open(disk);
  const std::int64_t start = 10 * Database::kHistoryUs;
  ASSERT_TRUE(store.write({.moves = {past_move("phi", start)}}));
  const std::int64_t jumps[] = {200 * kDayUs, -200 * kDayUs, 0, -start, 5000 * kDayUs};
  for (const std::int64_t jump : jumps) {
    write_until_looked(store, "theta", start + jump);
    EXPECT_THAT(*store.history("phi", 3), SizeIs(1)) << jump;
  }
}

// Those of a clock that was ahead are as old as what was written beside them.
TEST(Database, HistoryOfTheFutureDoesNotStay) {
  sim::SimDisk disk(1);
  Store store = open(disk);
  const std::int64_t start = 10 * Database::kHistoryUs;
  ASSERT_TRUE(store.write({.moves = {past_move("phi", start + 5000 * kDayUs)}}));
  for (std::int64_t day = 1; day <= kDays + 1; ++day) {
    ASSERT_TRUE(store.write({.moves = {past_move("theta", start + day * kDayUs)}}));
  }
  write_until_looked(store, "theta", start + (kDays + 2) * kDayUs);
  EXPECT_THAT(*store.history("phi", 3), IsEmpty());
}

TEST(Database, AnOlderVersionIsCopiedThenBroughtUpToDate) {
  sim::SimDisk disk(1);
  {
    Store store = open(disk);
  }
  const std::size_t now = all_versions().size();
  std::vector<const char*> newer(all_versions().begin(), all_versions().end());
  newer.push_back("ALTER TABLE setting ADD COLUMN who TEXT");
  std::vector<std::string> notes;
  {
    auto opened = Database::open(disk, kDatabase, 0, notes, newer);
    ASSERT_TRUE(opened) << opened.error().text();
  }
  EXPECT_THAT(notes, ElementsAre(HasSubstr("from version " + std::to_string(now) + " to " +
                                           std::to_string(now + 1))));
  // The copy is a database of the version before.
  EXPECT_TRUE(Database::open(disk, "/state/state.db.version-" + std::to_string(now), 0, notes));
  // This version does not know the newer one, and leaves it alone.
  const auto refused = Database::open(disk, kDatabase, 0, notes);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().text(), HasSubstr("made by a newer bushd"));
  EXPECT_TRUE(Database::open(disk, kDatabase, 0, notes, newer));
}

TEST(Database, TheFirstVersionKeepsItsHistory) {
  sim::SimDisk disk(1);
  std::vector<std::string> notes;
  {
    auto opened = Database::open(disk, kDatabase, 0, notes, all_versions().first(1));
    ASSERT_TRUE(opened) << opened.error().text();
  }
  auto opened = Database::open(disk, kDatabase, 0, notes);
  ASSERT_TRUE(opened) << opened.error().text();
  PastMove move = past_move("theta", 5);
  move.from_text = "1.0 mm";
  move.to_text = "2.0 mm";
  ASSERT_TRUE(opened->write({.moves = {move}}));
  EXPECT_THAT(*opened->history("theta", 3), ElementsAre(move));
}

// Older daemons left names behind at outputs that had become those of others.
TEST(Database, AnOutputIsThatOfTheNameThatWasWrittenLast) {
  sim::SimDisk disk(1);
  std::vector<std::string> notes;
  {
    // As they wrote them, in this order.
    std::vector<const char*> versions(all_versions().begin(), all_versions().begin() + 2);
    const std::string with_rows = std::string(versions.back()) +
                                  "INSERT INTO position VALUES ('theta', 1200, '400', 'known', '',"
                                  " 1, '0123456789abcdef', 7, 2, 1, 5);"
                                  "INSERT INTO position VALUES ('phi', 1200, '400', 'known', '',"
                                  " 1, '0123456789abcdef', 7, 2, 1, 5);";
    versions.back() = with_rows.c_str();
    const auto opened = Database::open(disk, kDatabase, 0, notes, versions);
    ASSERT_TRUE(opened) << opened.error().text();
  }
  auto opened = Database::open(disk, kDatabase, 0, notes);
  ASSERT_TRUE(opened) << opened.error().text();
  const auto records = *opened->records();
  EXPECT_EQ(records.at("phi").trust, Trust::kKnown);
  EXPECT_EQ(records.at("theta").trust, Trust::kUncertain);
  EXPECT_EQ(records.at("theta").unique_id, "");
  EXPECT_THAT(records.at("theta").reason, HasSubstr("last known: 1200 steps"));
}

TEST(Database, KeepsATargetThatIsNoStep) {
  sim::SimDisk disk(1);
  std::vector<std::string> notes;
  Record record = standing_at(1200, 1);
  record.target_steps = 1200;
  record.target_parts = -3;
  {
    auto opened = Database::open(disk, kDatabase, 0, notes);
    ASSERT_TRUE(opened->write({.records = {{"theta", record}}}));
  }
  EXPECT_EQ(Database::open(disk, kDatabase, 0, notes)->records()->at("theta"), record);
}

// Nothing that was acknowledged is lost, and nothing that was not marked looks like a move.
TEST(Store, SurvivesPowerCutsAtEveryWrite) {
  for (std::uint64_t cut = 1; cut < 120; ++cut) {
    sim::SimDisk disk(cut);
    std::uint64_t marked = 0;
    std::uint64_t asked = 0;
    std::optional<std::uint64_t> written;
    disk.lose_power_after(cut);
    if (auto store = Store::open(disk, an_opening())) {
      for (std::uint64_t motion = 1; disk.has_power(); ++motion) {
        asked = motion;
        if (store->mark({{"theta", motion}, {"phi", 1}})) marked = motion;
        const auto steps = static_cast<std::int64_t>(100 * motion);
        if (store->write({.records = {{"theta", standing_at(steps, motion)}}})) written = motion;
      }
    }
    disk.boot();
    Store store = open(disk);
    const Kept& kept = store.kept().at("theta");
    EXPECT_THAT(store.notes(), IsEmpty()) << cut;
    if (written) {
      ASSERT_TRUE(kept.record) << cut;
      EXPECT_GE(kept.record->motion, *written) << cut;
    }
    if (kept.record) {
      EXPECT_EQ(kept.record->steps, 100 * static_cast<std::int64_t>(kept.record->motion));
    }
    EXPECT_GE(kept.motion, marked) << cut;
    EXPECT_TRUE(!stood(kept) || kept.record->motion >= marked) << cut;
    EXPECT_LE(kept.motion, asked + 1) << cut;
  }
}

TEST(RealDisk, KeepsTheStoreAndLetsOneProcessHaveIt) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / ("bushd-state-" + std::to_string(getpid()));
  Opening opening = an_opening();
  opening.folder = folder / "below";
  {
    auto store = Store::open(real_disk(), opening);
    ASSERT_TRUE(store) << store.error().text();
    ASSERT_TRUE(store->mark({{"theta", 1}}));
    ASSERT_TRUE(store->write({.records = {{"theta", standing_at(1200, 1)}}}));
  }
  {
    auto store = Store::open(real_disk(), opening);
    ASSERT_TRUE(store) << store.error().text();
    EXPECT_EQ(store->kept().at("theta").record, standing_at(1200, 1));
    EXPECT_TRUE(stood(store->kept().at("theta")));
  }
  std::filesystem::remove_all(folder);
}

TEST(RealDisk, SaysWhyAFolderCannotBeUsed) {
  Opening opening = an_opening();
  opening.folder = "/dev/null/state";
  const auto store = Store::open(real_disk(), opening);
  ASSERT_FALSE(store);
  EXPECT_THAT(store.error().text(), HasSubstr("/dev/null/state"));
}

}  // namespace
}  // namespace bushd::state::store_test

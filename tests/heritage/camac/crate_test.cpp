#include "heritage/camac/crate.h"

#include <gtest/gtest.h>

#include "heritage/camac/bench.h"

namespace bushd::camac::crate_test {
namespace {

constexpr int kDisable = 24;
constexpr int kEnable = 26;
constexpr int kTest = 27;

class Probe final : public Module {
 public:
  Response cycle(const Command& command) override {
    seen = command;
    return {.x = true, .q = true, .data = 0x123456};
  }
  void initialise() override { ++initialised; }
  void clear() override { ++cleared; }
  void set_inhibit(bool now) override { inhibited = now; }
  bool lam() const override { return raises; }

  Command seen;
  int initialised = 0;
  int cleared = 0;
  bool inhibited = false;
  bool raises = false;
};

class CrateBench : public ::testing::Test {
 protected:
  CrateBench() {
    crate.insert(1, first);
    crate.insert(23, last);
  }
  Response cycle(int n, int a, int f, std::uint32_t data = 0) {
    return crate.cycle(n, {.subaddress = a, .function = f, .data = data});
  }

  Probe first;
  Probe last;
  Crate crate;
};

TEST_F(CrateBench, StationsAreAddressedByNumber) {
  EXPECT_EQ(text(cycle(23, 15, 17, 0x7FFFFFFF)), "X Q 1193046");
  EXPECT_EQ(last.seen.subaddress, 15);
  EXPECT_EQ(last.seen.function, 17);
  EXPECT_EQ(last.seen.data, 0xFFFFFFU) << "24 bits";
  cycle(1, 0, 0, 5);
  EXPECT_EQ(first.seen.data, 0U) << "a function that reads has no data to write";
}

TEST_F(CrateBench, EmptyStationsAnswerNothing) {
  for (const int n : {-1, 0, 2, 22, 24, 25, 26, 29, 31, 1000}) {
    EXPECT_EQ(text(cycle(n, 0, 0)), "- - 0") << n;
  }
  EXPECT_EQ(crate.at(1), &first);
  EXPECT_EQ(crate.at(2), nullptr);
  EXPECT_EQ(crate.at(0), nullptr);
}

// S3: each module is one station, and what it does depends on no other.
TEST(Crate, TakesModulesSideBySide) {
  MotorsBench motors;
  ShutterBench shutter;
  Bushd2 two(motors);
  Bushd1 one(shutter);
  Crate crate;
  crate.insert(5, two);
  crate.insert(6, one);
  crate.cycle(5, {.subaddress = 1, .function = 16, .data = 1000});
  crate.cycle(6, {.subaddress = 1, .function = 16, .data = 7});
  EXPECT_EQ(crate.cycle(5, {.subaddress = 1}).data, 1000U);
  EXPECT_EQ(crate.cycle(6, {.subaddress = 1}).data, 7U);
}

TEST_F(CrateBench, CommonControls) {
  EXPECT_EQ(text(cycle(28, 8, kEnable)), "X - 0");
  EXPECT_EQ(first.initialised + last.initialised, 2);
  EXPECT_EQ(text(cycle(28, 9, kEnable)), "X - 0");
  EXPECT_EQ(first.cleared + last.cleared, 2);
  EXPECT_EQ(text(cycle(28, 10, kEnable)), "- - 0");
  EXPECT_EQ(text(cycle(28, 8, kTest)), "- - 0");
}

TEST_F(CrateBench, Inhibit) {
  EXPECT_EQ(text(cycle(30, 9, kTest)), "X - 0");
  EXPECT_EQ(text(cycle(30, 9, kEnable)), "X - 0");
  EXPECT_TRUE(first.inhibited && last.inhibited && crate.inhibited());
  EXPECT_EQ(text(cycle(30, 9, kTest)), "X Q 0");
  Probe late;
  crate.insert(4, late);
  EXPECT_TRUE(late.inhibited);
  cycle(30, 9, kDisable);
  EXPECT_FALSE(first.inhibited || late.inhibited);
}

TEST_F(CrateBench, GradedRequestAndDemand) {
  EXPECT_EQ(text(cycle(30, 11, kTest)), "X - 0");
  last.raises = true;
  for (int a = 0; a < 8; ++a) EXPECT_EQ(cycle(30, a, 0).data, 1U << 22);
  EXPECT_EQ(text(cycle(30, 8, 0)), "- - 0");
  first.raises = true;
  EXPECT_EQ(crate.requests(), 1U << 22 | 1U);
  EXPECT_EQ(text(cycle(30, 11, kTest)), "X Q 0");
  EXPECT_FALSE(crate.demand_enabled());
  cycle(30, 10, kEnable);
  EXPECT_EQ(text(cycle(30, 10, kTest)), "X Q 0");
  EXPECT_TRUE(crate.demand_enabled());
  cycle(30, 10, kDisable);
  EXPECT_FALSE(crate.demand_enabled());
}

}  // namespace
}  // namespace bushd::camac::crate_test

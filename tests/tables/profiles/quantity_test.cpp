#include "tables/profiles/quantity.h"

#include <gtest/gtest.h>

namespace bushd::test {
namespace {

using tables::profiles::parse_quantity;
using tables::profiles::Quantity;

TEST(Quantity, UnitsAreConverted) {
  EXPECT_DOUBLE_EQ(*parse_quantity(Quantity::kSpeed, "2.5kHz"), 2500);
  EXPECT_DOUBLE_EQ(*parse_quantity(Quantity::kSpeed, "300 steps/s"), 300);
  EXPECT_DOUBLE_EQ(*parse_quantity(Quantity::kSpeed, "7"), 7);
  EXPECT_DOUBLE_EQ(*parse_quantity(Quantity::kAcceleration, "12kHz/s"), 12000);
  EXPECT_DOUBLE_EQ(*parse_quantity(Quantity::kTime, "250ms"), 0.25);
  EXPECT_DOUBLE_EQ(*parse_quantity(Quantity::kTimeUnit, "25us"), 25000);
  EXPECT_DOUBLE_EQ(*parse_quantity(Quantity::kTorque, "12Ncm"), 0.12);
  EXPECT_DOUBLE_EQ(*parse_quantity(Quantity::kInertia, "38gcm2"), 38e-7);
  EXPECT_DOUBLE_EQ(*parse_quantity(Quantity::kInertia, "120 g cm2"), 120e-7);
  EXPECT_DOUBLE_EQ(*parse_quantity(Quantity::kInertia, "1.2e-5 kg m2"), 1.2e-5);
  EXPECT_DOUBLE_EQ(*parse_quantity(Quantity::kInertia, "0.5 kg cm2"), 0.5e-4);
}

TEST(Quantity, PhysicsOfTheMotorNeedsItsUnit) {
  EXPECT_EQ(parse_quantity(Quantity::kInertia, "1.2e-5").error().message,
            "\"1.2e-5\"; allowed: a number with one of the units kg m2, g cm2, kg cm2");
  EXPECT_FALSE(parse_quantity(Quantity::kTorque, "0.12"));
  EXPECT_FALSE(parse_quantity(Quantity::kInertia, "12 kg"));
  EXPECT_FALSE(parse_quantity(Quantity::kInertia, "12 kg m2 "));
}

TEST(Quantity, AnythingElseIsRefused) {
  for (const char* text : {"", "Hz", "nan", "inf", "1e999", "5 rpm", "5Hz ", "0x", "--5", "5s"}) {
    EXPECT_FALSE(parse_quantity(Quantity::kSpeed, text)) << text;
  }
}

}  // namespace
}  // namespace bushd::test

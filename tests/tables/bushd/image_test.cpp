// Memory images of BUSHD-1 and BUSHD-2.
#include "tables/bushd/image.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <functional>

#include "engine/table.h"
#include "tables/random_table.h"

namespace bushd::test {
namespace {

namespace image = tables::image;
using tables::TableContent;
using testing::HasSubstr;

std::vector<std::uint16_t> random_codes(std::size_t count, int low, int high) {
  std::vector<std::uint16_t> codes;
  for (std::size_t i = 0; i < count; ++i) {
    codes.push_back(static_cast<std::uint16_t>(random_in(low, high)));
  }
  std::sort(codes.begin(), codes.end(), std::greater<>());
  return codes;
}

TEST(BushdImage, PageIsStepsThenCodesThenPositions) {
  image::Program program{.steps = 0x1234, .codes = std::vector<std::uint8_t>(238, 77)};
  program.codes.front() = 250;
  program.positions.fill(0xEE);
  const image::Page page = image::write_page(program);
  EXPECT_EQ(page[0], 0x34);
  EXPECT_EQ(page[1], 0x12);
  EXPECT_EQ(page[2], 250);
  EXPECT_EQ(page[239], 77);
  EXPECT_EQ(page[240], 0xEE);
  EXPECT_EQ(page[255], 0xEE);
}

TEST(BushdImage, PagesSurviveBothWays) {
  EXPECT_TRUE(rc::check("page -> table -> page", [] {
    image::Page page{};
    const auto codes = random_codes(238, 10, 250);
    std::copy(codes.begin(), codes.end(), page.begin() + 2);
    page[0] = static_cast<std::uint8_t>(random_in(0, 255));
    page[1] = static_cast<std::uint8_t>(random_in(0, 255));
    page[250] = static_cast<std::uint8_t>(random_in(0, 255));
    image::Program program = image::read_page(page);
    const auto table = image::table_of(program.codes, random_in(1, 100));
    RC_ASSERT(table.has_value());
    const auto back = image::codes_of(*table);
    RC_ASSERT(back.has_value());
    program.codes = *back;
    RC_ASSERT(image::write_page(program) == page);
  }));
}

TEST(BushdImage, TablesKeepTheirMotionBothWays) {
  EXPECT_TRUE(rc::check("table -> page -> table", [] {
    TableContent content{.name = "t", .time_unit_ns = 1'000'000'000U / 250 / 100};
    content.accel = random_codes(static_cast<std::size_t>(random_in(1, 238)), 10, 250);
    const auto codes = image::codes_of(content);
    RC_ASSERT(codes.has_value());
    const auto back = image::table_of(*codes, *image::start_hz_of(content));
    RC_ASSERT(back.has_value());
    const auto before = tables::make(content);
    const auto after = tables::make(*back);
    RC_ASSERT((*before)->view().time_unit_ns == (*after)->view().time_unit_ns);
    for (std::uint32_t j = 1; j <= 500; ++j) {
      RC_ASSERT(bushd_table_delay(&(*before)->view(), j, 500) ==
                bushd_table_delay(&(*after)->view(), j, 500));
    }
  }));
}

std::string refusal(const TableContent& content) {
  const auto codes = image::codes_of(content);
  return codes ? "taken" : codes.error().message;
}

TEST(BushdImage, WhatDoesNotFitIsRefusedWithTheReason) {
  TableContent content{.name = "t", .time_unit_ns = 40000, .accel = {250, 100, 10}};
  EXPECT_EQ(refusal(content), "taken");
  TableContent wrong = content;
  wrong.accel.assign(239, 100);
  EXPECT_THAT(refusal(wrong), HasSubstr("has 239 codes; a page of BUSHD-2 holds 238"));
  wrong = content;
  wrong.accel[2] = 9;
  EXPECT_THAT(refusal(wrong), HasSubstr("accel[2] is 9"));
  wrong = content;
  wrong.accel[0] = 256;
  EXPECT_THAT(refusal(wrong), HasSubstr("accel[0] is 256"));
  wrong = content;
  wrong.decel = {{10, 250}};
  EXPECT_THAT(refusal(wrong), HasSubstr("two different sides"));
  wrong = content;
  wrong.cruise = 12;
  EXPECT_THAT(refusal(wrong), HasSubstr("cruises at code 12 after 10"));
  wrong = content;
  for (const std::uint32_t time_unit_ns : {39'999U, 4'000'001U, 4'000'004U}) {
    wrong.time_unit_ns = time_unit_ns;
    EXPECT_THAT(refusal(wrong),
                HasSubstr("BUSHD-2 has 1..100 Hz, a time_unit_ns of 40000..4000000"));
  }
  for (const std::uint32_t time_unit_ns : {40'000U, 4'000'000U}) {
    wrong = content;
    wrong.time_unit_ns = time_unit_ns;
    EXPECT_EQ(refusal(wrong), "taken");
  }
}

TEST(BushdImage, ResampledTablesFitAndAreNeverFaster) {
  EXPECT_TRUE(rc::check("every delay of a long move", [] {
    TableContent content{.name = "t"};
    content.time_unit_ns = static_cast<std::uint32_t>(random_in(1000, 100'000));
    content.accel = random_codes(static_cast<std::size_t>(random_in(1, 600)), 1, 3000);
    RC_PRE(1.0 * content.accel.front() * content.time_unit_ns <= 1e9);
    const auto made = image::resample(content);
    RC_ASSERT(made.has_value());
    RC_ASSERT(image::codes_of(made->content).has_value());
    const auto before = tables::make(content);
    const auto after = tables::make(made->content);
    for (std::uint32_t j = 1; j <= 2000; ++j) {
      const double old_ns =
          1.0 * bushd_table_delay(&(*before)->view(), j, 2000) * content.time_unit_ns;
      const double new_ns =
          1.0 * bushd_table_delay(&(*after)->view(), j, 2000) * made->content.time_unit_ns;
      RC_ASSERT(new_ns >= old_ns * (1 - 1e-6));
    }
  }));
}

TEST(BushdImage, TravelOfBushd1IsAllDelaysOfTheMove) {
  const TableContent content{.name = "t", .time_unit_ns = 100'000, .accel = {200, 100, 50}};
  const auto travel = image::travel_of(content, 5, 300);
  ASSERT_TRUE(travel);
  EXPECT_THAT(image::write_travel(*travel),
              testing::ElementsAre(5, 0, 300 & 255, 300 >> 8, 200, 100, 50, 100, 200));
  EXPECT_THAT(image::travel_of(content, 127, 0).error().message, HasSubstr("travels 1..126"));
}

TEST(BushdImage, TravelsSurviveBothWays) {
  EXPECT_TRUE(rc::check("memory -> table -> memory", [] {
    std::vector<std::uint8_t> codes;
    for (const std::uint16_t code :
         random_codes(static_cast<std::size_t>(random_in(1, 63)), 1, 255))
      codes.push_back(static_cast<std::uint8_t>(code));
    auto down = random_codes(static_cast<std::size_t>(random_in(0, 63)), codes.back(), 255);
    for (auto code = down.rbegin(); code != down.rend(); ++code)
      codes.push_back(static_cast<std::uint8_t>(*code));
    const image::Travel travel{.reactor_delay = 7, .codes = codes};
    const auto bytes = image::write_travel(travel);
    const auto read = image::read_travel(bytes);
    RC_ASSERT(read.has_value());
    const auto table = image::table_of(*read, 100'000);
    RC_ASSERT(table.has_value());
    const auto again =
        image::travel_of(*table, static_cast<std::uint32_t>(codes.size()), read->reactor_delay);
    RC_ASSERT(again.has_value());
    RC_ASSERT(image::write_travel(*again) == bytes);
  }));
}

TEST(BushdImage, BrokenTravelsAreRefused) {
  EXPECT_FALSE(image::read_travel({}));
  EXPECT_FALSE(image::read_travel({5, 0, 0, 0, 1, 2}));
  EXPECT_FALSE(image::read_travel({127, 0, 0, 0}));
  EXPECT_FALSE(image::read_travel({1, 9, 0, 0, 50}));
  EXPECT_FALSE(image::table_of(image::Travel{.codes = {50, 100, 50, 100}}, 100'000));
}

}  // namespace
}  // namespace bushd::test

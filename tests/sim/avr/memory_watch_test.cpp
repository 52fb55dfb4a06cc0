// The watch over the image's memory sees what it is there for: pointers and counts of the image are
// bent from outside, and the code that follows them is named.
#include <gmock/gmock.h>

#include <stdexcept>

#include "sim/avr/avr_fixture.h"
#include "sim/avr/memory_map.h"

namespace bushd::sim::memory_watch_test {
namespace {

using testing::HasSubstr;

class AvrMemoryWatched : public AvrAlone {
 protected:
  void poke(std::uint16_t address, std::uint16_t value) {
    avr_->poke(address, static_cast<std::uint8_t>(value));
    avr_->poke(static_cast<std::uint16_t>(address + 1), static_cast<std::uint8_t>(value >> 8));
  }

  // What stops the image, if `act` does.
  template <class Act>
  std::string violation_of(Act act) {
    try {
      act();
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "none";
  }

  void start_moving() {
    run(0, 200);
    pass(100 * TimeNs{kTickNs});
  }

  AvrMemoryMap map_{AVR_IMAGES "-500000.elf", AVR_MEMORY_OWNERS};
};

TEST_F(AvrMemoryWatched, FindsNothingInGoodWork) {
  ASSERT_NO_FATAL_FAILURE(make_ready());
  EXPECT_EQ(violation_of([&] { start_moving(); }), "none");
}

TEST_F(AvrMemoryWatched, NamesWhoWritesIntoAnothersObject) {
  ASSERT_NO_FATAL_FAILURE(make_ready());
  poke(map_.address_of("mcu.config.queue"), map_.address_of("codes"));
  const std::string found = violation_of([&] { start_moving(); });
  EXPECT_THAT(found, HasSubstr("in codes"));
  EXPECT_THAT(found, testing::MatchesRegex(".+ \\(.+:[0-9]+\\).*: of .+ writes to 0x.+"));
}

TEST_F(AvrMemoryWatched, NamesWhoWritesWhereNothingIs) {
  poke(map_.address_of("mcu.config.reply"), static_cast<std::uint16_t>(map_.variables_end() + 16));
  EXPECT_THAT(violation_of([&] { master_.poll(kAddress); }), HasSubstr("which is no variable's"));
}

TEST_F(AvrMemoryWatched, NamesWhoWritesToAnAnswerThatIsBeingSent) {
  // The longest answer takes 3.7 ms; this falls into it, and is made where it lies.
  const std::string found = violation_of([&] {
    master_.post(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, Bytes{1, kAddress, 0, 0, 0, 255});
    pass(2'000'000);
    poke(map_.address_of("mcu.receiver.buffer"), 0);
    avr_->poke(map_.address_of("mcu.answer.size"), 20);
    pass(10'000'000);
  });
  EXPECT_THAT(found, HasSubstr("in the reply, which the line is sending"));
}

TEST_F(AvrMemoryWatched, NamesWhoReadsRegistersThroughAPointer) {
  ASSERT_NO_FATAL_FAILURE(make_ready());
  // What is kept is read through it, three codes of two bytes; the walk may be at any of them.
  poke(map_.address_of("mcu.config.codes"), 0x00C0);
  EXPECT_THAT(violation_of([&] { pass(2'000'000'000); }),
              testing::ContainsRegex("reads the I/O register 0x00c[0-5] "));
}

TEST_F(AvrMemoryWatched, NamesWhoLeavesTheEeprom) {
  ASSERT_NO_FATAL_FAILURE(make_ready());
  poke(static_cast<std::uint16_t>(map_.address_of("scan") + 3),
       4090);                               // bushd_mcu_nvm_scan.size
  avr_->poke(map_.address_of("phase"), 1);  // it writes
  EXPECT_THAT(violation_of([&] { pass(2'000'000'000); }),
              HasSubstr("of the EEPROM, beyond its end"));
}

}  // namespace
}  // namespace bushd::sim::memory_watch_test

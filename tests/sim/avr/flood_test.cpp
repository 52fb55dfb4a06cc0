// A line full of what is no frame keeps the image for ATmega2560 from nothing for long.
#include <algorithm>

#include "sim/avr/avr_fixture.h"

namespace bushd::sim::flood_test {
namespace {

constexpr std::uint32_t kFastBaud = 1'000'000;

class AvrFlooded : public AvrAlone {
 protected:
  AvrFlooded() : AvrAlone(kFastBaud) {}

  // The answer to a question behind it.
  bool answers_after(const Bytes& flood) {
    bus_.master_send(flood, bus_.now_ns());
    return master_
        .request(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, Bytes{1, kAddress, 0, 0, 0, 255},
                 kAddress)
        .has_value();
  }
};

// The main loop took 1300 cycles for each, eight times as long as the line does: the MCU fell 30 ms
// behind.
TEST_F(AvrFlooded, DelimitersDoNotKeepItBusy) {
  ASSERT_NO_FATAL_FAILURE(make_ready());
  run(0, 400);
  pass(30 * TimeNs{kTickNs});
  // From the question's end to the answer's beginning two ticks may have to be prepared.
  master_.patience_ns = 2 * TimeNs{kTickNs};
  EXPECT_TRUE(answers_after(Bytes(250, 0)));
  EXPECT_TRUE(answers_after(Bytes(2000, 0)));
}

TEST_F(AvrFlooded, ShortFramesKeepItBusyForTheRingsLengthOnly) {
  ASSERT_NO_FATAL_FAILURE(make_ready());
  Bytes flood(2000);
  for (std::size_t i = 0; i < flood.size(); i += 2) flood[i] = 1;
  // 128 of them wait in the line's ring at most, each for less than a tenth of a tick.
  master_.patience_ns = 13 * TimeNs{kTickNs};
  answers_after(flood);  // the ring was full: the question may have been lost
  EXPECT_TRUE(answers_after({}));
}

}  // namespace
}  // namespace bushd::sim::flood_test

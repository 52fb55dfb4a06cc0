// When the image for ATmega2560 answers: its reply must be over before another one's slot begins.
#include "sim/random.h"
#include "sim_avr/avr_fixture.h"

namespace bushd::sim {
namespace {

class AvrAnswers : public AvrAlone {};

TEST_F(AvrAnswers, BeginWithinATickInWhateverPhaseTheyAreAskedFor) {
  constexpr TimeNs kByteNs = TimeNs{10'000'000'000} / kBaud;
  pass(kBootNs);
  ASSERT_NO_FATAL_FAILURE(make_ready());
  run(3, 10'000);  // slots interrupt it all the time
  pass(50 * TimeNs{kTickNs});
  Random random(1, 0);
  for (int i = 0; i < 1000; ++i) {
    pass(random.between(0, TimeNs{kTickNs}));
    master_.post(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, Bytes{1, kAddress, 0, 0});
    const TimeNs asked_ns = bus_.line_busy_until_ns();
    master_.frames.clear();
    master_.drain();
    ASSERT_EQ(master_.frames.size(), 1u);
    const Frame& answer = master_.frames[0];
    const auto bytes =
        static_cast<TimeNs>(Master::wire(kAddress, answer.type, answer.tag, answer.payload).size());
    ASSERT_LT(answer.end_ns - bytes * kByteNs - asked_ns, TimeNs{kTickNs}) << "poll " << i;
  }
}

}  // namespace
}  // namespace bushd::sim

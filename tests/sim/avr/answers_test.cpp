// When the image for ATmega2560 answers: its reply must be over before another one's window begins.
#include "sim/avr/avr_fixture.h"
#include "sim/random.h"

namespace bushd::sim::answers_test {
namespace {

class AvrAnswers : public AvrAlone {};

TEST_F(AvrAnswers, BeginWithinATickInWhateverPhaseTheyAreAskedFor) {
  constexpr TimeNs kByteNs = TimeNs{10'000'000'000} / kBaud;
  ASSERT_NO_FATAL_FAILURE(make_ready());
  run(3, 10'000);  // slots interrupt it all the time
  pass(50 * TimeNs{kTickNs});
  Random random(1, 0);
  for (int i = 0; i < 1000; ++i) {
    pass(random.between(0, TimeNs{kTickNs}));
    master_.post(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, Bytes{1, kAddress, 0, 0, 0, 255});
    const TimeNs asked_ns = bus_.wire_busy_until_ns();
    master_.frames.clear();
    master_.drain();
    ASSERT_EQ(master_.frames.size(), 1u);
    const Frame& answer = master_.frames[0];
    const auto bytes = static_cast<TimeNs>(
        FrameMaster::wire(kAddress, answer.type, answer.sequence, answer.payload).size());
    ASSERT_LT(answer.end_ns - bytes * kByteNs - asked_ns, TimeNs{kTickNs}) << "poll " << i;
  }
}

// An answer that waits for its window lies where frames are received.
TEST_F(AvrAnswers, AreWholeWhateverPassesByBefore) {
  constexpr std::uint8_t kOther = 9;
  ASSERT_NO_FATAL_FAILURE(make_ready());
  Random random(2, 0);
  const auto longest = [&] {
    Bytes payload(BUSHD_FRAME_MAX_PAYLOAD);
    for (std::uint8_t& byte : payload) byte = static_cast<std::uint8_t>(random.between(0, 255));
    return payload;
  };
  // Polls of this MCU, to be answered after 16 ms.
  const auto ask = [&] {
    master_.frames.clear();
    const Bytes poll = {1, kAddress, 1600 & 0xFF, 1600 >> 8, 0, 255};
    master_.post(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, poll);
  };
  const auto expect_answer = [&] {
    master_.drain();
    std::erase_if(master_.frames, [](const Frame& frame) { return frame.address != kAddress; });
    ASSERT_EQ(master_.frames.size(), 1u);
    const auto report = decoded(master_.frames[0].payload, bushd_decode_report);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->motor_count, 16);
  };
  for (int i = 0; i < 20; ++i) {
    ask();
    for (int other = 0; other < 3; ++other) {
      bus_.master_send(Bytes{0x55}, bus_.now_ns());  // as a transceiver may when it is switched on
      master_.post(kOther, BUSHD_MSG_POLL | BUSHD_TYPE_REPLY, longest());
    }
    ASSERT_NO_FATAL_FAILURE(expect_answer()) << i;
  }
  EXPECT_EQ(master_.poll(kAddress).bad_frames, 60) << "those single bytes";
  // No master speaks before an answer's time; one that does gets none, and is heard whatever it
  // says.
  for (const std::uint8_t address : {kOther, kAddress}) {
    ask();
    master_.post(address, BUSHD_MSG_TICKS, longest());
    master_.drain();
    std::erase_if(master_.frames, [](const Frame& frame) { return frame.address != kAddress; });
    EXPECT_TRUE(master_.frames.empty());
    const bushd_report report = master_.poll(kAddress);
    EXPECT_EQ(report.bad_frames, 60);
    EXPECT_EQ(report.rejected_frames, address == kAddress ? 1 : 0) << "heard, and refused";
  }
  ask();
  EXPECT_TRUE(master_.identify(kAddress));
  EXPECT_EQ(master_.poll(kAddress).bad_frames, 60);
}

TEST_F(AvrAnswers, FollowFramesOfEveryLength) {
  constexpr std::uint8_t kUnknown = 0x7E;
  for (std::size_t size = 0; size <= BUSHD_FRAME_MAX_PAYLOAD; ++size) {
    const Bytes payload(size, static_cast<std::uint8_t>(size));
    const auto answer = master_.request(kAddress, kUnknown, payload);
    ASSERT_TRUE(answer) << size;
    ASSERT_EQ(answer->payload, Bytes{BUSHD_E_UNKNOWN_MESSAGE}) << size;
  }
  EXPECT_EQ(master_.poll(kAddress).bad_frames, 0);
}

}  // namespace
}  // namespace bushd::sim::answers_test

// How soon the MCUs of a whole bus can be used: after a start of the daemon, and after their power
// came.
#include <gtest/gtest.h>

#include <map>

#include "bus/bus_times.h"
#include "daemon/lab.h"

namespace bushd::test {
namespace {

constexpr int kMcus = 16;
// How long the connector waits between two questions to an MCU that has not answered.
constexpr double kRetry_s = 0.5;
// How long a new daemon listens for another master, from the last SYNC that MCUs have heard.
constexpr double kListens_s = 3e-6 * fieldbus::kSyncPeriodUs;

std::string one_bus(const std::string& baud) {
  std::string toml = hall(kMcus, 1);
  const std::string before = "baud = 500000\ntick_us = 2560";
  return toml.replace(toml.find(before), before.size(), "baud = " + baud + "\ntick_us = 10000");
}

struct ConnectLab : Lab {
  explicit ConnectLab(const std::string& baud = "1000000") : Lab(one_bus(baud)) {}
  // Seconds from now until all MCUs are ready.
  double until_ready() {
    const std::int64_t from_us = now_us();
    EXPECT_TRUE(run_until([this] { return all_ready(); }, 60));
    return static_cast<double>(now_us() - from_us) * 1e-6;
  }
  void lose_power(double seconds, double apart_s) {
    for (std::size_t m = 0; m < kMcus; ++m) {
      const double down_s = seconds + static_cast<double>(m) * apart_s;
      bus(0).reboot(m, static_cast<sim::TimeNs>(down_s * 1e9));
    }
  }
};

// What an earlier daemon has asked for is answered when the next one begins, and its first IDENTIFY
// is lost by that: the MCU is asked again in time, though all the others were offline then as well.
TEST(ConnectTime, OneLostAnswerKeepsNoMcuAway) {
  ConnectLab lab;
  lab.until_ready();
  lab.restart_daemon();
  // A new daemon listens for another master first, and asks again meanwhile. The setup of 16 MCUs
  // is 12 exchanges each, of 1 ms at most, and some polls of all of them, 40 ms each: half a
  // second.
  EXPECT_LT(lab.until_ready(), std::max(kListens_s, kRetry_s) + 0.5);
}

TEST(ConnectTime, McusWhosePowerComesTogetherAreReadyTogether) {
  ConnectLab lab;
  const double setup_s = lab.until_ready();
  // While none answers each is asked as often as the line allows: 16 time-outs of 42 ms. After the
  // first answer one question in vain may cost the others a pause, and one more where they come
  // one after the other.
  constexpr double kRound_s = kMcus * 0.042;
  for (const double apart_s : {0.0, 0.02}) {
    for (const double down_s : {1.0, 3.3}) {
      SCOPED_TRACE(std::to_string(down_s) + " s, each " + std::to_string(apart_s) + " s later");
      lab.lose_power(down_s, apart_s);
      lab.restart_daemon();
      const double last_s = down_s + (kMcus - 1) * apart_s;
      EXPECT_LT(lab.until_ready() - last_s, kRound_s + 2 * kRetry_s + setup_s);
    }
  }
}

// After a daemon that is gone for so long that nobody has to be listened for, and after lost power.
TEST(ConnectTime, AllAreReadyWithinASecondOfTheLastFirstAnswer) {
  for (const char* baud : {"1000000", "4000000"}) {
    for (const double down_s : {0.0, 1.0, 3.3}) {
      SCOPED_TRACE(std::string(baud) + " baud, without power for " + std::to_string(down_s) + " s");
      ConnectLab lab(baud);
      lab.until_ready();
      std::map<unsigned, std::int64_t> first_answer_us;  // by address
      bushd_receiver receiver{};
      lab.on_receive = [&](std::size_t, std::uint8_t& byte) {
        bushd_frame frame;
        const bool whole = bushd_receive_byte(&receiver, byte, &frame) == BUSHD_RECEIVE_FRAME;
        if (whole && frame.type == (BUSHD_MSG_IDENTIFY | BUSHD_TYPE_REPLY)) {
          first_answer_us.try_emplace(frame.address, lab.now_us());
        }
      };
      if (down_s != 0) lab.lose_power(down_s, 0);
      lab.restart_daemon([&] {
        if (down_s == 0) lab.pass_without_daemon(kListens_s);
      });
      lab.until_ready();
      const std::int64_t ready_us = lab.now_us();
      ASSERT_EQ(first_answer_us.size(), std::size_t{kMcus});
      std::int64_t last_us = 0;
      for (const auto& [address, us] : first_answer_us) last_us = std::max(last_us, us);
      EXPECT_LE(ready_us - last_us, 1'000'000);
    }
  }
}

// A question without an answer costs a bus that others use a time-out.
TEST(ConnectTime, ManyAbsentMcusAreAskedNoOftenerThanOne) {
  ConnectLab lab;
  lab.until_ready();
  for (std::size_t m = 4; m < kMcus; ++m) lab.bus(0).reboot(m, 1'000'000'000'000);
  lab.run_for(5);
  std::map<unsigned, int> questions;  // by address
  bushd_receiver receiver{};
  lab.on_send = [&](std::size_t, std::vector<std::uint8_t>& bytes) {
    for (const std::uint8_t byte : bytes) {
      bushd_frame frame;
      const bool whole = bushd_receive_byte(&receiver, byte, &frame) == BUSHD_RECEIVE_FRAME;
      if (whole && frame.type == BUSHD_MSG_IDENTIFY) ++questions[frame.address];
    }
    return true;
  };
  lab.run_for(10);
  // One each kRetry_s and time-out, of 42 ms: 18 in 10 s, and one more by where the 10 s begin. By
  // turns each of the 12 has one or two of them.
  int all = 0;
  for (const auto& [address, count] : questions) {
    EXPECT_GE(count, 1) << address;
    EXPECT_LE(count, 2) << address;
    all += count;
  }
  EXPECT_EQ(questions.size(), 12u);
  EXPECT_GE(all, 18);
  EXPECT_LE(all, 19);
}

}  // namespace
}  // namespace bushd::test

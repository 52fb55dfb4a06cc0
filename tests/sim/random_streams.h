// Whatever comes over the line, in whatever phase of a move: the image lives on, answers the next
// question, and counts the pulses that it makes. For every kind of MCU the same.
//
//     BUSHD_STREAMS=10000 BUSHD_SEED=1 sim_avr_test --gtest_filter='*RandomStreams*'
#pragma once

#include <errno.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <string>

#include "sim/bus_fixture.h"
#include "sim/pulse_counter.h"
#include "sim/random.h"

namespace bushd::sim {

inline std::uint64_t from_environment(const char* name, std::uint64_t otherwise) {
  const char* const text = std::getenv(name);
  return text != nullptr ? std::strtoull(text, nullptr, 10) : otherwise;
}

// The command that shows a failure again.
inline std::string again(std::uint64_t seed, std::uint64_t streams) {
  const auto* const test = testing::UnitTest::GetInstance()->current_test_info();
  return "BUSHD_SEED=" + std::to_string(seed) + " BUSHD_STREAMS=" + std::to_string(streams) + " " +
         program_invocation_short_name + " --gtest_filter=" + test->test_suite_name() + "." +
         test->name();
}

class RandomStreams : public testing::Test {
 protected:
  static constexpr int kGroup = 50;
  static constexpr std::size_t kMotorsInUse = 4;
  static constexpr std::uint8_t kLastType = [] {
    std::uint8_t last = 0;
#define BUSHD_OR_LATER(type, number, kind, needs) last = std::max<std::uint8_t>(last, number);
    BUSHD_MESSAGES(BUSHD_OR_LATER)
#undef BUSHD_OR_LATER
    return last;
  }();
  static constexpr std::uint32_t kBaud = 1'000'000;
  static constexpr std::uint32_t kTickNs = 2'560'000;
  static constexpr std::uint8_t kAddress = 2;
  static constexpr TimeNs kPatienceNs = 4'000'000;

  RandomStreams(TimeNs boot_ns, const Bus::MakeMcu& make)
      : seed_(from_environment("BUSHD_SEED", std::random_device{}())),
        random_(seed_, 0),
        bus_(kBaud, &counter_),
        master_(bus_) {
    bus_.add_mcu(make);
    master_.patience_ns = kPatienceNs;
    bus_.advance_to(boot_ns);
  }

  // What a test of it does; this many streams if the environment asks for no other number.
  void leave_it_alive(std::uint64_t by_default) {
    const std::uint64_t streams = from_environment("BUSHD_STREAMS", by_default);
    std::printf("%s\n", again(seed_, streams).c_str());  // before what may be thrown
    SCOPED_TRACE(again(seed_, streams));
    std::uint64_t moves = 0;
    const std::uint16_t boot_number = master_.poll(kAddress).boot_number;
    for (std::uint64_t done = 0; done < streams && !HasFailure(); ++done) {
      SCOPED_TRACE("stream " + std::to_string(done));
      if (done % kGroup == 0) {
        ASSERT_NO_FATAL_FAILURE(make_ready());
      }
      if (random_.one_in(2)) start_move();
      bus_.advance_to(bus_.now_ns() + random_.between(0, 8'000'000));
      for (std::int64_t pieces = random_.between(1, 4); pieces > 0; --pieces) {
        random_.one_in(2) ? send_frame() : send_noise();
      }
      send({0});
      master_.drain();
      const bushd_report report = ask();
      ASSERT_EQ(report.boot_number, boot_number) << "it has booted anew";
      tick_ = report.tick;
      epoch_ = report.epoch;
      if (report.moving != 0) ++moves;
      if (done % kGroup + 1 == kGroup || done + 1 == streams) {
        settle();
        expect_right_counts();
      }
    }
    std::printf(
        "%llu streams, %llu bytes, %llu pulses; %llu ended while a motor moved; asked "
        "again %d times\n",
        static_cast<unsigned long long>(streams), static_cast<unsigned long long>(sent_),
        static_cast<unsigned long long>(counter_.pulses), static_cast<unsigned long long>(moves),
        asked_again_);
  }

 private:
  std::uint8_t byte() { return static_cast<std::uint8_t>(random_.below(256)); }
  Bytes bytes(std::size_t size) {
    Bytes out(size);
    for (auto& b : out) b = byte();
    return out;
  }

  // Moves a motor, if the MCU is still ready for it.
  void start_move() {
    const bushd_table_run_entry entry{static_cast<std::uint8_t>(random_.below(kMotorsInUse)), 0,
                                      static_cast<std::int8_t>(random_.one_in(2) ? 1 : -1),
                                      static_cast<std::uint32_t>(random_.between(1, 200)), 0};
    master_.post(kAddress, BUSHD_MSG_TABLE_RUN, test::table_run_payload(epoch_, tick_ + 9, entry));
  }

  // What a master might send; what changes a count is left out.
  Bytes sensible_payload(std::uint8_t type) {
    switch (type) {
      case BUSHD_MSG_TABLE_RUN: {
        const bushd_table_run_entry entry{static_cast<std::uint8_t>(random_.below(16)), 0, 1,
                                          static_cast<std::uint32_t>(random_.between(1, 90)), 0};
        return test::table_run_payload(epoch_, tick_ + 10, entry);
      }
      case BUSHD_MSG_TICKS: {
        // Fine or coarse, whichever length that has.
        Bytes payload = test::ticks_payload({.flags = static_cast<std::uint8_t>(byte() & 7),
                                             .first = tick_ + 10,
                                             .count = 8,
                                             .mask = 0x000F,
                                             .delays = {300, 200, 0, 150},
                                             .epoch = epoch_});
        const Bytes displacements = bytes(64);
        const auto end = displacements.begin() + (random_.one_in(2) ? 32 : 64);
        payload.insert(payload.end(), displacements.begin(), end);
        return payload;
      }
      case BUSHD_MSG_CONFIGURE:
        return test::request_of(bushd_configure{kTickNs, BUSHD_FORMAT_FINE, 20}).payload;
      case BUSHD_MSG_POLL:
        return {1, kAddress, 0, 0, byte(), byte()};
      default:
        return bytes(random_.below(40));
    }
  }

  // A frame of the master's, its payload bent now and then; for somebody else or with a sequence
  // out of order now and then.
  void send_frame() {
    std::uint8_t type = 0;
    do {
      type = static_cast<std::uint8_t>(random_.between(1, kLastType));
    } while (type == BUSHD_MSG_SET_POSITION);
    if (!random_.one_in(4)) {
      type = std::array<std::uint8_t, 5>{BUSHD_MSG_TABLE_RUN, BUSHD_MSG_TICKS, BUSHD_MSG_TICKS,
                                         BUSHD_MSG_CONFIGURE, BUSHD_MSG_POLL}[random_.below(5)];
    }
    Bytes payload = sensible_payload(type);
    if (!payload.empty() && random_.one_in(4)) random_.pick(payload) = byte();
    const std::uint8_t address = random_.one_in(8) ? byte() : kAddress;
    if (random_.one_in(16)) {
      send(FrameMaster::wire(address, type, byte(), payload));
    } else {
      master_.post(address, type, payload);
      sent_ += payload.size() + 8;
    }
  }

  void send_noise() {
    switch (random_.below(3)) {
      case 0:
        return send(bytes(random_.below(200)));
      case 1:
        return send(Bytes(random_.below(300), byte()));
      default: {
        const auto type = static_cast<std::uint8_t>(random_.between(1, kLastType));
        Bytes frame = FrameMaster::wire(kAddress, type, byte(), bytes(random_.below(120)));
        if (random_.one_in(2)) {
          frame.resize(random_.below(frame.size()));
        } else {
          random_.pick(frame) ^= static_cast<std::uint8_t>(1 << random_.below(8));
        }
        return send(frame);
      }
    }
  }

  void send(const Bytes& stream) {
    bus_.master_send(stream, bus_.now_ns());
    sent_ += stream.size();
  }

  void make_ready() {
    // Sequences of noise count as heard until there has been silence, and what it has asked for may
    // be answered as late as a poll can say.
    bus_.advance_to(bus_.now_ns() + TimeNs{UINT16_MAX} * BUSHD_REPLY_UNIT_NS);
    master_.patience_ns = 5 * kPatienceNs;
    ASSERT_EQ(master_.acknowledged(kAddress, bushd_set_inputs{}), BUSHD_OK);
    ASSERT_EQ(
        master_.acknowledged(
            kAddress, bushd_control{BUSHD_CONTROL_CLEAR_FAULTS | BUSHD_CONTROL_FORGET_TABLES, 0}),
        BUSHD_OK);
    const bushd_format format = random_.one_in(2) ? BUSHD_FORMAT_FINE : BUSHD_FORMAT_COARSE;
    ASSERT_NO_FATAL_FAILURE(master_.bring_up(kTickNs, format));
    ASSERT_NO_FATAL_FAILURE(master_.upload_table(kAddress, 0, 10'000, {400, 300, 200}, 150));
    for (std::uint8_t m = 0; m < kMotorsInUse; ++m) {
      ASSERT_NO_FATAL_FAILURE(master_.assign(kAddress, m, 0));
    }
    master_.patience_ns = kPatienceNs;
  }

  // All motors come to rest, by themselves or not.
  void settle() {
    if (random_.one_in(4)) bus_.advance_to(bus_.now_ns() + 300'000'000);
    master_.send(kAddress, BUSHD_MSG_EMERGENCY, Bytes{BUSHD_STOP_IMMEDIATE});
    bus_.advance_to(bus_.now_ns() + 100'000'000);
  }

  // An answer that noise has asked for, to be given later, may fall upon a question; and several
  // long frames at once take a while.
  bushd_report ask() {
    for (int attempt = 0; attempt < 3; ++attempt) {
      master_.patience_ns = attempt == 0 ? kPatienceNs : 5 * kPatienceNs;
      const auto reply = master_.request(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL,
                                         Bytes{1, kAddress, 0, 0, 0, 255}, kAddress);
      const auto report = reply ? decoded(reply->payload, bushd_decode_report) : std::nullopt;
      if (report) {
        master_.patience_ns = kPatienceNs;
        return *report;
      }
      ++asked_again_;
    }
    ADD_FAILURE() << "no report";
    return {};
  }

  void expect_right_counts() {
    const bushd_report report = ask();
    EXPECT_EQ(report.moving, 0);
    for (std::size_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
      EXPECT_EQ(report.motor[m].position_steps, static_cast<std::int32_t>(counter_.count[m]))
          << "motor " << m;
    }
  }

  const std::uint64_t seed_;
  Random random_;
  PulseCounter counter_;
  Bus bus_;
  FrameMaster master_;
  std::uint32_t tick_ = 0;
  std::uint8_t epoch_ = 0;
  std::uint64_t sent_ = 0;  // bytes
  int asked_again_ = 0;
};

}  // namespace bushd::sim

// What fuzzers have found for the core, on the images: each input of the corpora is said to one
// over the line and its pins, and time passes. It lives on, does not boot by itself, answers,
// counts the pulses that it makes, and makes none without EN. What cannot be done from outside is
// done as near to it as may be: a reset is one of the chip; what was kept by then comes back.
//
//     BUSHD_CORPUS=FILE conformance_test --gtest_filter='*Corpus*'     that input alone
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>

#include "conformance/targets.h"
#include "fuzz/core_programme.h"
#include "sim/bus_fixture.h"
#include "sim/pulse_counter.h"
#include "source_path.h"

namespace bushd::sim::corpus_test {
namespace {

namespace fs = std::filesystem;

// Tables as they were sent, and taken.
class SentTables {
 public:
  void begin(const bushd_table_begin& message) {
    Sent& sent = sent_[message.bank];
    sent.table = {};
    sent.table.accel.count = message.accel_count;
    sent.table.decel.count = message.decel_count != 0 ? message.decel_count : message.accel_count;
    sent.table.cruise = message.cruise;
    sent.table.time_unit_ns = message.time_unit_ns;
    sent.codes.assign(std::size_t{message.accel_count} + message.decel_count, 0);
    sent.decel_at = message.decel_count != 0 ? message.accel_count : 0;
  }
  void data(const bushd_table_data& message) {
    Sent& sent = sent_[message.bank];
    for (std::size_t i = 0; i < message.count && message.offset + i < sent.codes.size(); ++i) {
      sent.codes[message.offset + i] = bushd_get_u16(message.codes + 2 * i);
    }
  }
  std::uint32_t crc(std::uint8_t bank) {
    Sent& sent = sent_[bank];
    if (sent.codes.empty()) return 0;
    sent.table.accel.code = sent.codes.data();
    sent.table.decel.code = sent.codes.data() + sent.decel_at;
    return bushd_table_crc32(&sent.table);
  }

 private:
  struct Sent {
    bushd_table table{};
    std::vector<std::uint16_t> codes;
    std::size_t decel_at = 0;
  };
  std::map<std::uint8_t, Sent> sent_;
};

class ImageReplay final : public fuzz::Programmed {
 public:
  explicit ImageReplay(const Target& target)
      : real_(target.make()), bus_(kBaud, &counter_), master_(bus_) {
    std::uint64_t unique_id = 0;
    for (std::size_t i = kUniqueId.size(); i-- > 0;) unique_id = unique_id << 8 | kUniqueId[i];
    const Birth birth{kAddress, unique_id, 6};
    bus_.add_mcu([&](std::size_t index, Mcu::Driver& driver, EdgeSink* sink) {
      return real_->make(birth, index, driver, sink);
    });
  }

  void begin() override {
    advance(kBootNs);
    ask(last_);
    boot_number_ = last_.boot_number;
  }

  fuzz::Sight sight() override {
    const std::uint64_t pulses = counter_.pulses;
    if (ask(last_)) {
      EXPECT_EQ(last_.boot_number, boot_number_) << "it has booted by itself";
      if (last_.moving == 0 && pulses == counter_.pulses) check_counts(last_);
    }
    // A report takes a few ticks to come, and what is asked for then has to come too.
    const auto passed = static_cast<std::uint32_t>((bus_.now_ns() - asked_ns_) / tick_ns_);
    return {address(),    real_->twin().motors, last_.epoch,   last_.tick + passed + 1,
            tick_ns_,     sync_master_,         last_.sync_id, last_.sync_tick,
            last_.sync_ns};
  }

  std::uint32_t table_crc(std::uint8_t bank) override { return tables_.crc(bank); }

  void pass() override {
    if (!pins_set_) bus_.node(0).set_inputs(moving_pins(++ticks_));
    advance(tick_ns_);
  }

  void feed(fuzz::Bytes bytes) override {
    bus_.master_send(bytes, bus_.now_ns());
    advance(bus_.wire_busy_until_ns() - bus_.now_ns());
  }

  void frame(std::uint8_t address, std::uint8_t type, fuzz::Bytes payload,
             std::uint8_t later) override {
    if (type == BUSHD_MSG_SYNC) note_master(payload);
    next_sequence_ = static_cast<std::uint8_t>(next_sequence_ + later);
    const bool taken = acknowledges(type) && send(address, type, payload) &&
                       !answer_.payload.empty() && answer_.payload[0] == BUSHD_OK;
    if (!acknowledges(type)) post(address, type, payload);
    if (taken) note(type, payload);
  }

  void set_time(std::uint16_t share) override { advance(TimeNs{tick_ns_} * share >> 16); }

  void set_pins(std::uint16_t motors, std::uint8_t system, std::uint16_t current) override {
    pins_set_ = true;
    pins_ = {motors, static_cast<std::uint8_t>(system & BUSHD_SYSTEM_INPUTS)};
    bus_.node(0).set_inputs(pins_);
    set_current(current);
  }

  // Both edges: whichever is waited for.
  void trigger(std::int16_t share) override {
    advance(TimeNs{tick_ns_} * std::abs(share) / 32768);
    for (int edge = 0; edge < 2; ++edge) {
      pins_.system ^= BUSHD_INPUT_TRIGGER;
      bus_.node(0).set_inputs(pins_);
      advance(100'000);
    }
  }

  void sample(std::uint16_t share, std::uint16_t current) override {
    set_current(current);
    set_time(share);
  }

  void work(unsigned pieces) override { advance(TimeNs{pieces} * 100'000); }

  void reset() override {
    bus_.reboot(0);
    advance(kBootNs);
    ++boot_number_;
    // The core that the programme is for goes on at once; what the image keeps may take longer.
    counter_.count = offset_ = {};
    tick_ns_ = BUSHD_BOOT_TICK_NS;
    configured_.clear();
    emission_.reset();
  }

  std::uint64_t pulses() const { return counter_.pulses; }
  void rest(unsigned ticks) { advance(TimeNs{tick_ns_} * ticks); }

  void check_answers() override {
    set_pins(0, 0, 0);
    // Some answers may come as late as a poll can say.
    advance(TimeNs{UINT16_MAX} * BUSHD_REPLY_UNIT_NS);
    post(address(), BUSHD_MSG_EMERGENCY,
         fuzz::Bytes(std::array<std::uint8_t, 1>{BUSHD_STOP_IMMEDIATE}));
    advance(100'000'000);
    const std::array<std::uint8_t, 5> at_once = {0, 0, 1, 0, 0};
    ASSERT_TRUE(send(address(), BUSHD_MSG_IDENTIFY, at_once)) << "no identity";
    bushd_identity identity;
    ASSERT_EQ(bushd_decode_identity(answer_.payload.data(), answer_.payload.size(), &identity),
              BUSHD_OK);
    EXPECT_EQ(identity.boot_number, boot_number_);
    EXPECT_TRUE(std::equal(kUniqueId.begin(), kUniqueId.end(), identity.unique_id));
    ASSERT_TRUE(ask(last_)) << "no report";
    EXPECT_EQ(last_.boot_number, boot_number_) << "it has booted by itself";
    EXPECT_EQ(last_.moving, 0);
    check_counts(last_);
    // The tick in which it falls is emitted to its end, and with EMERGENCY and its input the next
    // one, if it is prepared.
    if (!phases_) {
      EXPECT_LT(counter_.without_enable_ns, 2 * TimeNs{longest_tick_ns_});
    }
    real_->expect_unharmed();
  }

 private:
  static constexpr std::uint32_t kBaud = 500'000;
  static constexpr TimeNs kBootNs = 300'000'000;
  static constexpr TimeNs kPatienceNs = 12'000'000;

  static bool acknowledges(std::uint8_t type) {
    return type == BUSHD_MSG_CONFIGURE || type == BUSHD_MSG_TABLE_BEGIN ||
           type == BUSHD_MSG_TABLE_DATA || type == BUSHD_MSG_SET_POSITION ||
           type == BUSHD_MSG_EMISSION || type == BUSHD_MSG_HOME;
  }

  void advance(TimeNs ns) { bus_.advance_to(bus_.now_ns() + std::max<TimeNs>(ns, 0)); }
  std::uint8_t address() { return bus_.node(0).address(); }
  void set_current(std::uint16_t current) {
    bus_.node(0).set_current(static_cast<std::uint16_t>(current % (BUSHD_MAX_CURRENT + 1)));
  }

  void post(std::uint8_t address, std::uint8_t type, fuzz::Bytes payload) {
    feed(Bytes{0});
    feed(FrameMaster::wire(address, type, next_sequence_++, payload));
  }

  // Whether it is answered; the answer is answer_.
  bool send(std::uint8_t address, std::uint8_t type, fuzz::Bytes payload) {
    const std::uint8_t sequence = next_sequence_;
    master_.frames.clear();
    post(address, type, payload);
    asked_ns_ = bus_.now_ns();
    for (TimeNs waited = 0; waited < kPatienceNs; waited += 200'000) {
      for (const Frame& frame : master_.frames) {
        if (frame.type != (type | BUSHD_TYPE_REPLY) || frame.sequence != sequence) continue;
        answer_ = frame;
        return true;
      }
      advance(200'000);
    }
    return false;
  }

  // An answer that noise has asked for may fall upon a question.
  bool ask(bushd_report& report) {
    for (int attempt = 0; attempt < 3; ++attempt) {
      const std::array<std::uint8_t, 6> me = {1, address(), 0, 0, 0, 255};
      if (send(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, me) &&
          bushd_decode_report(answer_.payload.data(), answer_.payload.size(), &report) ==
              BUSHD_OK) {
        return true;
      }
    }
    return false;
  }

  void note_master(fuzz::Bytes payload) {
    bushd_sync sync;
    if (bushd_decode_sync(payload.data(), payload.size(), &sync) == BUSHD_OK) {
      sync_master_ = sync.master;
    }
  }

  // What the MCU has taken.
  void note(std::uint8_t type, fuzz::Bytes payload) {
    const auto decode = [&](auto* function, auto message) {
      function(payload.data(), payload.size(), &message);
      return message;
    };
    switch (type) {
      case BUSHD_MSG_CONFIGURE: {
        const auto message = decode(bushd_decode_configure, bushd_configure{});
        tick_ns_ = message.tick_ns;
        longest_tick_ns_ = std::max(longest_tick_ns_, tick_ns_);
        const std::vector<std::uint32_t> now{message.tick_ns, message.format};
        if (configured_ != now) emit_by(BUSHD_EMISSION_EVEN);
        configured_ = now;
        break;
      }
      case BUSHD_MSG_TABLE_BEGIN:
        return tables_.begin(decode(bushd_decode_table_begin, bushd_table_begin{}));
      case BUSHD_MSG_TABLE_DATA:
        return tables_.data(decode(bushd_decode_table_data, bushd_table_data{}));
      case BUSHD_MSG_SET_POSITION: {
        const auto message = decode(bushd_decode_set_position, bushd_set_position{});
        offset_[message.motor] =
            static_cast<std::uint32_t>(message.position_steps) - counter_.count[message.motor];
        break;
      }
      case BUSHD_MSG_HOME:
        homed_ |= 1u << decode(bushd_decode_home, bushd_home{}).motor;
        break;
      case BUSHD_MSG_EMISSION:
        emit_by(decode(bushd_decode_emission, bushd_emission{}).mode);
        break;
      default:
        break;
    }
  }

  // Levels of windings are no pulses.
  void emit_by(std::uint8_t mode) {
    const bool counted = emission_ && *emission_ != BUSHD_EMISSION_PHASES;
    // What the pins say counts from here on.
    adopt_ = adopt_ || !counted;
    emission_ = mode;
    phases_ = phases_ || mode == BUSHD_EMISSION_PHASES;
    counter_.common_dir = bushd_emission_has_common_dir(mode);
  }

  void check_counts(const bushd_report& report) {
    if (!emission_ || *emission_ == BUSHD_EMISSION_PHASES) return;
    for (std::size_t m = 0; m < report.motor_count; ++m) {
      const auto told = static_cast<std::uint32_t>(report.motor[m].position_steps);
      if (adopt_) offset_[m] = told - counter_.count[m];
      // Where homing ends the position gets another name.
      if ((homed_ >> m & 1) != 0) continue;
      EXPECT_EQ(told, counter_.count[m] + offset_[m]) << "motor " << m;
    }
    adopt_ = false;
  }

  std::unique_ptr<McuUnderTest> real_;
  PulseCounter counter_;
  Bus bus_;
  FrameMaster master_;
  SentTables tables_;
  Frame answer_{};
  bushd_report last_{};
  std::uint16_t boot_number_ = 0;
  std::uint8_t next_sequence_ = 0;
  TimeNs asked_ns_ = 0;  // the last question's end
  std::uint16_t sync_master_ = 0;
  std::uint32_t tick_ns_ = BUSHD_BOOT_TICK_NS;
  std::uint32_t longest_tick_ns_ = BUSHD_BOOT_TICK_NS;
  std::vector<std::uint32_t> configured_;  // tick and format
  std::optional<std::uint8_t> emission_ = BUSHD_EMISSION_EVEN;
  bool phases_ = false;  // ever
  bool adopt_ = false;   // the next report's positions, whatever they are
  unsigned homed_ = 0;   // motors
  std::array<std::uint32_t, BUSHD_MOTORS_PER_MCU> offset_{};
  bool pins_set_ = false;
  bushd_inputs pins_{};
  std::uint32_t ticks_ = 0;
};

// A test is to be over within minutes: it replays every so-many'th input.
struct CorpusOn {
  Target target;
  std::string corpus;
  std::size_t part;
  std::size_t parts;

  friend void PrintTo(const CorpusOn& value, std::ostream* out) {
    *out << value.target.name << " " << value.corpus << " " << value.part;
  }
};

std::vector<fs::path> inputs_of(const CorpusOn& what) {
  std::vector<fs::path> files;
  const char* const only = std::getenv("BUSHD_CORPUS");
  if (only != nullptr) return {only};
  for (const auto& entry :
       fs::directory_iterator(fs::path(test::source_path("tests/fuzz/corpus")) / what.corpus)) {
    files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  std::vector<fs::path> part;
  for (std::size_t i = what.part; i < files.size(); i += what.parts) part.push_back(files[i]);
  return part;
}

std::vector<CorpusOn> all() {
  std::vector<CorpusOn> out;
  for (const Target& target : targets()) {
    for (std::size_t part = 0; part < 4; ++part) out.push_back({target, "firmware_core", part, 4});
    out.push_back({target, "firmware_core_avr", 0, 1});
    out.push_back({target, "firmware_core_lm3s6965", 0, 1});
  }
  return out;
}

class Corpus : public testing::TestWithParam<CorpusOn> {};

TEST_P(Corpus, LeavesTheImageAliveAnsweringAndCountingRight) {
  const auto* const test = testing::UnitTest::GetInstance()->current_test_info();
  std::uint64_t pulses = 0;
  std::size_t moving = 0;  // inputs
  const std::vector<fs::path> inputs = inputs_of(GetParam());
  for (const fs::path& path : inputs) {
    SCOPED_TRACE("BUSHD_CORPUS=" + path.string() + " conformance_test --gtest_filter=" +
                 test->test_suite_name() + "." + test->name());
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> bytes{std::istreambuf_iterator<char>(file), {}};
    ASSERT_TRUE(file);
    ImageReplay replay(GetParam().target);
    try {
      fuzz::run(replay, {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()},
                {[](fuzz::Input& input) { input.u8(); },  // a pace: the line has its own
                 [&](fuzz::Input& input) { replay.rest(fuzz::rest_ticks(input)); }});
    } catch (const std::exception& error) {
      FAIL() << error.what();
    }
    if (HasFailure()) return;
    pulses += replay.pulses();
    moving += replay.pulses() != 0;
  }
  std::printf("%zu inputs; %zu moved motors, %llu pulses\n", inputs.size(), moving,
              static_cast<unsigned long long>(pulses));
}

GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(Corpus);
INSTANTIATE_TEST_SUITE_P(Of, Corpus, testing::ValuesIn(all()), [](const auto& test) {
  return test.param.target.name + "_" + test.param.corpus + "_" + std::to_string(test.param.part);
});

}  // namespace
}  // namespace bushd::sim::corpus_test

// At every configuration that is accepted, a stop takes effect within a stated time, and nothing
// runs dry (docs/performance.md, Time of a stop).
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <string>

#include "bus/bus_budget.h"
#include "bus/rs485/slave.h"
#include "source_path.h"

namespace bushd::test {
namespace {

using link::Tick;

constexpr std::int64_t kRampUs = 300'000;

struct Line {
  std::uint32_t baud;
  std::uint32_t tick_us;
  bushd_format format;
  int mcus;
  int motors;
};

std::ostream& operator<<(std::ostream& out, const Line& line) {
  return out << line.baud << " baud, ticks of " << line.tick_us << " us, "
             << (line.format == BUSHD_FORMAT_FINE ? "fine, " : "coarse, ") << line.mcus
             << " MCUs of " << line.motors << " motors";
}

bool is_accepted(const Line& line) {
  const std::vector<std::uint8_t> motors(static_cast<std::size_t>(line.mcus),
                                         static_cast<std::uint8_t>(line.motors));
  return fieldbus::bus_load(line.baud, line.tick_us * 1000, line.format, motors) <=
         fieldbus::kMaxBusLoad;
}

// The shortest tick that is accepted at each rate, one in between, and the longest.
std::vector<Line> lines() {
  std::vector<Line> all;
  for (const std::uint32_t baud : {9'600u, 19'200u, 38'400u, 57'600u, 115'200u, 230'400u, 460'800u,
                                   500'000u, 921'600u, 2'000'000u, 4'000'000u}) {
    for (const bushd_format format : {BUSHD_FORMAT_FINE, BUSHD_FORMAT_COARSE}) {
      for (const int mcus : {1, 2, 4, 8}) {
        for (const int motors : {1, 4, 8, 16}) {
          Line line{baud, BUSHD_MAX_TICK_NS / 1000, format, mcus, motors};
          if (!is_accepted(line)) continue;
          all.push_back(line);
          std::uint32_t refused = BUSHD_MIN_TICK_NS / 1000 - 1;
          while (line.tick_us - refused > 1) {
            Line middle = line;
            middle.tick_us = refused + (line.tick_us - refused) / 2;
            (is_accepted(middle) ? line.tick_us : refused) = middle.tick_us;
          }
          all.push_back(line);
          line.tick_us = std::min(2 * line.tick_us, BUSHD_MAX_TICK_NS / 1000);
          all.push_back(line);
        }
      }
    }
  }
  return all;
}

// Motors that go on for ever until they are stopped, and then ramp down.
class Source : public link::TickSource {
 public:
  explicit Source(const Line& line) : ramp_(kRampUs / line.tick_us + 1) {}
  std::map<std::pair<std::size_t, std::uint8_t>, Tick> stop;

  std::uint16_t render(McuIndex mcu, std::uint8_t motor, Tick first, unsigned count,
                       std::int16_t* out, std::size_t stride) override {
    for (unsigned i = 0; i < count; ++i) out[i * stride] = 1;
    return first + count >= end_tick(mcu, motor) ? std::uint16_t{0} : std::uint16_t{100};
  }
  std::optional<RunSegment> run_at(McuIndex, std::uint8_t, Tick, unsigned) override {
    return std::nullopt;
  }
  Tick end_tick(McuIndex mcu, std::uint8_t motor) override {
    const auto at = stop.find({mcu.value, motor});
    return at == stop.end() ? 1'000'000'000 : at->second + ramp_;
  }

 private:
  Tick ramp_;
};

class Moving {
 public:
  explicit Moving(const Line& line)
      : line_(line),
        source_(line),
        bus(line.mcus, line.motors, line.format, line.tick_us * 1000, line.baud) {
    for (Slave& slave : bus.slaves) slave.identity.queue_ticks = line.tick_us < 1'000 ? 1024 : 256;
    bus.source.end = [](std::uint8_t) { return 1'000'000'000; };
    bus.master = std::make_unique<link::Rs485Master>(bus.setup, source_);
    bus.master->port_opened(bus.now_us);
    bus.connect();
  }
  void begin(bool runs) {
    Tick start = 0;
    for (std::size_t i = 0; i < bus.slaves.size(); ++i) {
      for (std::uint8_t m = 0; m < line_.motors; ++m) {
        start = std::max(start, bus.master->earliest_start(bus.now_us, McuIndex{i}, m));
      }
    }
    for (std::size_t i = 0; i < bus.slaves.size(); ++i) {
      for (std::uint8_t m = 0; m < line_.motors; ++m) {
        if (runs) {
          bus.master->begin_table_run(McuIndex{i}, m, start, {.steps = 1'000'000});
        } else {
          bus.master->begin(McuIndex{i}, m, start);
        }
      }
    }
  }

  // Stops motors, by MCU, all at once.
  void stop(const std::vector<link::ToReplace>& together) {
    asked_us_ = bus.now_us;
    stops_.clear();
    plan(together);
  }
  // Until it is known what became of it, and some time more.
  void run_for(std::int64_t us) {
    std::size_t seen = bus.events.size();
    const auto follow = [&] {
      for (; seen < bus.events.size(); ++seen) {
        const auto* failed = std::get_if<link::ReplacementFailed>(&bus.events[seen]);
        if (failed == nullptr) continue;
        ++failures;
        plan({{failed->mcu, failed->motors}});
      }
      return false;
    };
    bus.run_until(follow, us);
  }
  // From when it was asked for until the last motor obeys.
  double took_us() const {
    Tick latest = 0;
    for (const auto& [mcu, at] : stops_) latest = std::max(latest, at);
    return static_cast<double>(latest * line_.tick_us + bus.slaves[0].zero_us - asked_us_);
  }
  void expect_nothing_ran_dry() const {
    EXPECT_EQ(bus.count<link::StartMissed>(), 0);
    for (const Slave& slave : bus.slaves) {
      EXPECT_EQ(slave.faults, 0) << "MCU " << int{slave.address};
      for (std::size_t m = 0; m < static_cast<std::size_t>(line_.motors); ++m) {
        EXPECT_TRUE(slave.delay[m] == 0 && !slave.run[m]) << "goes on";
      }
    }
  }
  // Motors from .. until - 1 of every MCU of which `every` divides the place, without `but`.
  std::vector<link::ToReplace> motors(int from, int until, std::size_t every = 1) const {
    const auto mask = static_cast<std::uint16_t>((1u << until) - (1u << from));
    std::vector<link::ToReplace> all;
    for (std::size_t i = 0; i < bus.slaves.size() && mask != 0; i += every) {
      all.push_back({.mcu = McuIndex{i}, .motors = mask});
    }
    return all;
  }
  std::vector<link::ToReplace> all_motors() const { return motors(0, line_.motors); }

 private:
  void plan(const std::vector<link::ToReplace>& together) {
    const Tick at = bus.master->earliest_replace(bus.now_us, together);
    for (const link::ToReplace& asked : together) {
      for (std::uint8_t m = 0; m < line_.motors; ++m) {
        if ((asked.motors >> m & 1) != 0) source_.stop[{asked.mcu.value, m}] = at;
      }
      stops_[asked.mcu.value] = at;
      bus.master->replace(asked.mcu, asked.motors, at);
    }
  }

  Line line_;
  Source source_;
  std::map<std::size_t, Tick> stops_;
  std::int64_t asked_us_ = 0;

 public:
  FakeBus bus;
  int failures = 0;
};

// What the line takes, from the layout of frames (docs/protocol.md).
struct Times {
  explicit Times(const Line& line) {
    const auto line_us = [&](double bytes) { return bytes * 10e6 / line.baud; };
    const double frame = 10;  // address, type, sequence number, CRC, COBS, delimiters
    const double width = line.format == BUSHD_FORMAT_FINE ? 2 : 1;
    const double room = std::floor((247 - 9 - 2.0 * line.motors) / (width * line.motors));
    const double ticks = std::min({16.0, room, std::floor(150'000.0 / line.tick_us)});
    const double report = line_us(frame + 72 + 6.0 * line.motors) + 600;
    round = line.mcus * line_us(frame + 9 + line.motors * (2 + width * ticks));
    poll = line_us(frame + 1 + 5.0 * line.mcus) + 1'000 + 600 +
           std::min(line.mcus * report, std::max(report, 60'000.0));
    const double longest = line_us(257);
    stop = 5'000 + std::max(poll, longest) + round + 10'000 + 4.0 * line.tick_us;
  }
  double round;  // a full frame of ticks to each MCU
  double poll;   // of all MCUs, with the answers
  double stop;   // docs/performance.md, Time of a stop, with an adapter that holds nothing back
};

unsigned seeds() {
  const char* told = std::getenv("BUSHD_STOP_SEEDS");
  return told == nullptr ? 1 : static_cast<unsigned>(std::atoi(told));
}

// Each line with motors that have gone for a while, as streams or as runs of their tables.
template <class Test>
void on_every_line(std::int64_t latency_us, const Test& test) {
  unsigned seed = 0;
  for (unsigned round = 0; round < seeds(); ++round) {
    for (const Line& line : lines()) {
      const bool runs = (++seed + round) % 2 == 0;
      SCOPED_TRACE(testing::Message()
                   << line << (runs ? ", runs" : ", streams") << ", seed " << seed);
      std::mt19937 random(seed);
      Moving moving(line);
      moving.bus.adapter_latency_us = latency_us;
      moving.run_for(300'000);
      moving.begin(runs);
      moving.run_for(700'000 + random() % 100'000);
      test(line, moving, random);
      if (testing::Test::HasFailure()) return;
    }
  }
}

TEST(StopTime, IsWithinWhatIsStated) {
  for (const std::int64_t latency_us : {0, 2'000}) {
    on_every_line(latency_us, [&](const Line& line, Moving& moving, std::mt19937&) {
      moving.stop(moving.all_motors());
      moving.run_for(900'000);
      EXPECT_LE(moving.took_us(), Times(line).stop + 2.0 * static_cast<double>(latency_us));
      EXPECT_EQ(moving.failures, 0);
      moving.expect_nothing_ran_dry();
    });
  }
}

// The other motors of each MCU are stopped, and those of other MCUs: the motors of the first stop
// need ticks, and their MCUs are not yet known to have taken it.
TEST(StopTime, IsLongerByAPollAndARoundWhileAnotherChangeIsNotConfirmed) {
  on_every_line(0, [&](const Line& line, Moving& moving, std::mt19937& random) {
    const int half = line.motors / 2;
    const bool by_mcus = half == 0 || random() % 2 == 0;
    const Times times(line);
    moving.stop(by_mcus ? moving.motors(0, line.motors, 2) : moving.motors(0, half));
    moving.run_for(random() % 60'000);
    EXPECT_LE(moving.took_us(), times.stop);
    std::vector<link::ToReplace> others =
        by_mcus ? moving.all_motors() : moving.motors(half, line.motors);
    if (by_mcus) std::erase_if(others, [](const auto& one) { return one.mcu.value % 2 == 0; });
    if (!others.empty()) moving.stop(others);
    moving.run_for(900'000);
    EXPECT_LE(moving.took_us(), times.stop + 20'000 + times.poll + 2 * times.round);
    EXPECT_EQ(moving.failures, 0);
    moving.expect_nothing_ran_dry();
  });
}

// Each time the others, and the polls, go on; and each try is a shorter frame, further ahead.
TEST(StopTime, OfAnMcuThatLosesLongFramesEndsInAShortOne) {
  on_every_line(0, [&](const Line& line, Moving& moving, std::mt19937& random) {
    const std::size_t which = random() % moving.bus.slaves.size();
    std::size_t longest = 0;
    moving.bus.slaves[which].loses = [&longest](const Heard& heard) {
      if (heard.type != BUSHD_MSG_TICKS || (heard.payload[1] & BUSHD_TICKS_REPLACE) == 0)
        return false;
      const std::size_t ticks = heard.payload[6];
      longest = std::max(longest, ticks);
      return ticks > 1 && ticks > longest / 4;
    };
    const std::size_t heard = moving.bus.heard_of(BUSHD_MSG_POLL).size();
    moving.stop(moving.all_motors());
    moving.run_for(2'500'000);
    EXPECT_LE(moving.failures, 2);
    EXPECT_GE(moving.bus.heard_of(BUSHD_MSG_POLL).size() - heard, 25u) << "half of what is usual";
    for (const Slave& slave : moving.bus.slaves) {
      for (std::size_t m = 0; m < static_cast<std::size_t>(line.motors); ++m) {
        EXPECT_TRUE(slave.delay[m] == 0 && !slave.run[m]) << "goes on";
      }
    }
  });
}

// The lines of the table, all motors of all MCUs at once, in milliseconds.
TEST(StopTime, DocumentSaysTheSame) {
  std::ifstream file(source_path("docs/performance.md"));
  const std::string document{std::istreambuf_iterator<char>(file), {}};
  for (const auto& [line, text] : std::vector<std::pair<Line, std::string>>{
           {{57'600, 5'000, BUSHD_FORMAT_FINE, 1, 4}, "57600 | 5000 | fine | 1 x 4"},
           {{115'200, 3'000, BUSHD_FORMAT_FINE, 1, 8}, "115200 | 3000 | fine | 1 x 8"},
           {{500'000, 2'560, BUSHD_FORMAT_FINE, 1, 4}, "500000 | 2560 | fine | 1 x 4"},
           {{500'000, 2'560, BUSHD_FORMAT_FINE, 2, 16}, "500000 | 2560 | fine | 2 x 16"},
           {{1'000'000, 1'000, BUSHD_FORMAT_COARSE, 4, 4}, "1000000 | 1000 | coarse | 4 x 4"}}) {
    EXPECT_TRUE(is_accepted(line)) << line;
    const Times times(line);
    const std::string row = "| " + text + " | " + std::to_string(std::lround(times.poll / 1000)) +
                            " | " + std::to_string(std::lround(times.round / 1000)) + " | " +
                            std::to_string(std::lround(times.stop / 1000)) + " |";
    EXPECT_NE(document.find(row), std::string::npos) << row;
  }
}

}  // namespace
}  // namespace bushd::test

// The program itself, from outside: a real process, a real tty, a real file.
#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <termios.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <optional>
#include <regex>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "engine/frame.h"
#include "engine/message.h"
#include "sim/vcd_reader.h"
#include "source_path.h"

namespace {

using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

constexpr auto kPatience = std::chrono::seconds(20);  // used up only when something is broken

// Looks until it holds. The program under test is a process of its own, so there is nothing to be
// woken by.
template <class Condition>
bool eventually(Condition condition) {
  const auto until = std::chrono::steady_clock::now() + kPatience;
  while (!condition()) {
    if (std::chrono::steady_clock::now() > until) return false;
    ::usleep(1000);
  }
  return true;
}

std::string read_file(const std::string& path) {
  std::ifstream in(path);
  std::stringstream text;
  text << in.rdbuf();
  return text.str();
}

// The name itself, wherever it may lead.
bool there(const std::string& link) {
  return std::filesystem::exists(std::filesystem::symlink_status(link));
}

std::string new_folder() {
  std::string pattern = testing::TempDir() + "bushsim_XXXXXX";
  if (::mkdtemp(pattern.data()) == nullptr) throw std::runtime_error("no temporary folder");
  return pattern;
}

// The host's side of the serial port.
class Port {
 public:
  explicit Port(const std::string& path) : fd_(::open(path.c_str(), O_RDWR | O_NOCTTY)) {
    EXPECT_GE(fd_, 0) << path;
  }
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;
  ~Port() { ::close(fd_); }

  int fd() const { return fd_; }

  // One window: answered at once.
  void ask_who(std::uint8_t address) const {
    const bushd_identify message{.salt = 0, .windows = 1, .window_units = 0};
    std::uint8_t payload[BUSHD_FRAME_MAX_PAYLOAD];
    const std::size_t payload_size = bushd_encode_identify(&message, payload);
    std::uint8_t wire[BUSHD_FRAME_MAX_WIRE];
    const std::size_t size =
        bushd_frame_encode(address, BUSHD_MSG_IDENTIFY, 77, payload, payload_size, wire);
    ASSERT_EQ(::write(fd_, wire, size), static_cast<ssize_t>(size));
  }

  // The identity of an MCU, as it answers now.
  std::optional<bushd_identity> identify(std::uint8_t address) const {
    ask_who(address);
    bushd_receiver receiver{};
    bushd_frame frame;
    for (;;) {
      pollfd ready{fd_, POLLIN, 0};
      std::uint8_t byte = 0;
      if (::poll(&ready, 1, static_cast<int>(kPatience / std::chrono::milliseconds(1))) != 1 ||
          ::read(fd_, &byte, 1) != 1) {
        return std::nullopt;
      }
      if (bushd_receive_byte(&receiver, byte, &frame) == BUSHD_RECEIVE_FRAME) break;
    }
    bushd_identity identity{};
    EXPECT_EQ(frame.address, address);
    EXPECT_EQ(frame.type, BUSHD_MSG_IDENTIFY | BUSHD_TYPE_REPLY);
    EXPECT_EQ(frame.sequence, 77);
    EXPECT_EQ(bushd_decode_identity(frame.payload, frame.payload_size, &identity), BUSHD_OK);
    return identity;
  }

 private:
  int fd_;
};

class Bushsim : public testing::Test {
 protected:
  Bushsim() { write_config({"hall"}); }

  ~Bushsim() override {
    if (process > 0) {
      ::kill(process, SIGKILL);
      ::waitpid(process, nullptr, 0);
    }
    std::filesystem::remove_all(folder);
  }

  // Buses of one name each, with MCUs 1 and 2 on each, and a motor at the first of all.
  void write_config(const std::vector<std::string>& buses, int baud = 500'000) const {
    std::ofstream(folder + "/slow.toml")
        << "name = \"slow\"\ntime_unit_ns = 40000\naccel = [250, 125]\n";
    std::ofstream file(config);
    file << "[[group]]\nname = \"all\"\ntable = \"slow\"\n"
         << "[[motor]]\nname = \"theta\"\nmcu = \"" << buses.front()
         << ":1\"\noutput = 0\ngroup = \"all\"\n";
    for (const std::string& bus : buses) {
      file << "[[bus]]\nname = \"" << bus << "\"\nport = \"" << folder << "/" << bus
           << "\"\nbaud = " << baud << "\ntick_us = 2560\nformat = \"fine\"\n";
      for (const int address : {1, 2}) {
        file << "[[mcu]]\nbus = \"" << bus << "\"\naddress = " << address << "\n";
      }
    }
  }

  void start(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), BUSHSIM_PROGRAM);
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    process = ::fork();
    ASSERT_GE(process, 0);
    if (process != 0) return;
    constexpr int kCreate = O_WRONLY | O_CREAT | O_TRUNC;
    if (::dup2(::open(out.c_str(), kCreate, 0600), 1) < 0) ::_exit(126);
    if (::dup2(::open(err.c_str(), kCreate, 0600), 2) < 0) ::_exit(126);
    ::execv(argv[0], argv.data());
    ::_exit(127);
  }

  void start_ready(const std::vector<std::string>& more = {}) {
    std::vector<std::string> arguments = {"--config", config, "--link", link, "--trace", trace};
    arguments.insert(arguments.end(), more.begin(), more.end());
    start(arguments);
    ASSERT_TRUE(eventually([&] { return read_file(out) == "bushsim: ready " + link + "\n"; }))
        << read_file(out) << read_file(err);
  }

  // Waits for the end; the exit code, or minus the signal that killed it.
  int finish() {
    int status = 0;
    EXPECT_TRUE(eventually([&] { return ::waitpid(process, &status, WNOHANG) == process; }));
    process = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

  int stop(int signal = SIGTERM) {
    ::kill(process, signal);
    return finish();
  }

  // Runs what is expected to be refused; returns what it says.
  std::string refusal(const std::vector<std::string>& arguments, int exit_code = 1) {
    start(arguments);
    EXPECT_EQ(finish(), exit_code);
    EXPECT_THAT(read_file(out), Not(HasSubstr("ready")));
    return read_file(err);
  }

  const std::string folder = new_folder();
  const std::string config = folder + "/bushd.toml";
  const std::string link = folder + "/hall";
  const std::string trace = folder + "/trace.vcd";
  const std::string out = folder + "/out";
  const std::string err = folder + "/err";
  pid_t process = -1;
};

TEST_F(Bushsim, BothMcusAnswerAndTheTraceIsWholeAfterSigterm) {
  start_ready({"--boot-number", "4711"});
  {
    const Port port(link);
    for (const std::uint8_t address : {std::uint8_t{1}, std::uint8_t{2}}) {
      const auto identity = port.identify(address);
      ASSERT_TRUE(identity);
      EXPECT_EQ(identity->boot_number, 4711);
      EXPECT_EQ(identity->motors, 16);
    }
  }
  EXPECT_EQ(stop(), 0);
  EXPECT_FALSE(there(link));
  EXPECT_THAT(read_file(out), HasSubstr("mcu2: 0 steps made; bad frames 0, rejected 0"));
  EXPECT_THAT(read_file(out), HasSubstr("collisions 0, corrupted bytes 0, dropped bytes 0"));
  const bushd::sim::VcdFile vcd = bushd::sim::read_vcd(trace);
  EXPECT_EQ(vcd.timescale, "1ns");
  EXPECT_EQ(vcd.wires.size(), 2u * 37u);  // STEP and DIR of 16, and five others
  EXPECT_TRUE(vcd.wires.contains("mcu1.step15"));
  EXPECT_TRUE(vcd.wires.contains("mcu2.en"));
  EXPECT_GT(vcd.stamps.back(), 0);
}

TEST_F(Bushsim, McusThatItCannotMakeAreRefused) {
  const auto refused = [this](const std::string& mcu) {
    return refusal({"--config", config, "--link", link, "--mcu", mcu});
  };
  EXPECT_THAT(refused("3=virtual"), HasSubstr("no MCU of this address"));
  EXPECT_THAT(refused("1"), HasSubstr("must be ADDRESS=virtual or"));
  EXPECT_THAT(refused("1=z80"), HasSubstr("neither virtual nor"));
  EXPECT_THAT(refused("1=atmega2560:/nowhere.elf"), HasSubstr("--mcu 1=atmega2560:/nowhere.elf: "));
  EXPECT_FALSE(there(link));
}

TEST_F(Bushsim, ImagesAreThoseOfTheirBus) {
  EXPECT_THAT(refusal({"--config", config, "--link", link, "--mcu", "1=atmega328p:/dev/null"}),
              HasSubstr("neither virtual nor atmega2560:IMAGE.elf"));
  const std::string board = folder + "/board.toml";
  std::ofstream(board)
      << "[[group]]\nname = \"all\"\ntable = \"slow\"\n[[motor]]\nname = \"m0\"\nmcu = \"board\"\n"
         "output = 0\ngroup = \"all\"\n[[bus]]\nname = \"board\"\nkind = \"commutator\"\n"
         "port = \"/dev/null\"\nbaud = 500000\nstart_hz = 100\n";
  const auto refused = [&](const std::string& mcu) {
    return refusal({"--config", board, "--link", link, "--mcu", mcu});
  };
  EXPECT_THAT(refused("1=atmega2560:/dev/null"), HasSubstr("which a commutator board has"));
  EXPECT_THAT(refused("2=virtual"), HasSubstr("no MCU of this address"));
  EXPECT_THAT(refusal({"--config", board, "--link", link, "--converter-gain", "1.1"}),
              HasSubstr("this bus is no board with a converter"));
}

#ifdef LM3S_IMAGE
TEST_F(Bushsim, AnImageOfACortexMAnswersBesideAVirtualMcu) {
  start_ready({"--mcu", std::string("2=lm3s6965:") + LM3S_IMAGE});
  {
    const Port port(link);
    ASSERT_TRUE(port.identify(1));
    const auto image = port.identify(2);
    ASSERT_TRUE(image);
    EXPECT_EQ(image->slots, 128);
    EXPECT_EQ(image->queue_ticks, 512);
  }
  EXPECT_EQ(stop(), 0);
  EXPECT_TRUE(bushd::sim::read_vcd(trace).wires.contains("mcu2.step15"));
}
#endif

#ifdef AVR_IMAGE
TEST_F(Bushsim, AnImageOfAnAtmegaAnswersBesideAVirtualMcu) {
  start_ready({"--mcu", "1=virtual", "--mcu", std::string("2=atmega2560:") + AVR_IMAGE});
  {
    const Port port(link);
    const auto plain = port.identify(1);
    ASSERT_TRUE(plain);
    EXPECT_EQ(plain->slots, 256);
    const auto image = port.identify(2);
    ASSERT_TRUE(image);
    EXPECT_EQ(image->slots, 128);
    EXPECT_EQ(image->queue_ticks, 64);
  }
  EXPECT_EQ(stop(), 0);
  EXPECT_TRUE(bushd::sim::read_vcd(trace).wires.contains("mcu2.step15"));
}
#endif

TEST_F(Bushsim, HostMayCloseAndComeBackEvenFromExclusiveUse) {
  start_ready();
  {
    const Port port(link);
    ASSERT_EQ(::ioctl(port.fd(), TIOCEXCL), 0);
    ASSERT_TRUE(port.identify(1));
  }
  const Port again(link);  // root may open it in any case
  EXPECT_TRUE(eventually([&] {
    int exclusive = 1;
    return ::ioctl(again.fd(), TIOCGEXCL, &exclusive) == 0 && exclusive == 0;
  }));
  EXPECT_TRUE(again.identify(2));
  EXPECT_EQ(stop(SIGINT), 0);
}

TEST_F(Bushsim, UnpluggedThePortHangsUpAndIsBackUnderItsNamesInTurn) {
  const std::string other = folder + "/hall-again";
  start_ready({"--link", other});
  std::string name = link;
  for (const std::string& next : {other, link, other}) {
    const Port port(name);
    ASSERT_TRUE(port.identify(1));
    ::kill(process, SIGUSR1);
    EXPECT_TRUE(eventually([&] {
      pollfd ready{port.fd(), POLLIN, 0};
      return ::poll(&ready, 1, 0) == 1 && (ready.revents & POLLHUP) != 0;
    }));
    EXPECT_FALSE(there(link) || there(other));
    ::kill(process, SIGUSR1);  // it is out already
    ::kill(process, SIGUSR2);
    EXPECT_TRUE(eventually([&] { return there(next); }));
    EXPECT_FALSE(there(name));
    name = next;
  }
  ::kill(process, SIGUSR2);  // it is in already
  EXPECT_TRUE(Port(name).identify(2));
  EXPECT_EQ(stop(), 0);
  EXPECT_FALSE(there(link) || there(other));
}

TEST_F(Bushsim, NameThatIsTakenWhenItIsPluggedInEndsIt) {
  start_ready();
  ::kill(process, SIGUSR1);
  ASSERT_TRUE(eventually([&] { return !there(link); }));
  std::ofstream(link) << "precious";
  ::kill(process, SIGUSR2);
  EXPECT_EQ(finish(), 1);
  EXPECT_THAT(read_file(err), HasSubstr(link));
  EXPECT_EQ(read_file(link), "precious");
  EXPECT_GT(bushd::sim::read_vcd(trace).stamps.back(), 0);
}

TEST_F(Bushsim, TtyIsRaw) {
  start_ready();
  const Port port(link);
  termios settings{};
  ASSERT_EQ(::tcgetattr(port.fd(), &settings), 0);
  EXPECT_EQ(settings.c_lflag & static_cast<tcflag_t>(ECHO | ICANON | ISIG), 0u);
  EXPECT_EQ(settings.c_oflag & static_cast<tcflag_t>(OPOST), 0u);
  EXPECT_EQ(stop(), 0);
}

TEST_F(Bushsim, RepliesThatNobodyReadsAreDroppedAndCounted) {
  write_config({"hall"}, 4'000'000);
  start_ready();
  const Port port(link);
  // Far more replies than a tty can hold. They collide with the requests, which makes them no
  // shorter.
  for (int i = 0; i < 30'000; ++i) port.ask_who(1);
  EXPECT_EQ(stop(), 0);
  const std::string summary = read_file(out);
  EXPECT_THAT(summary, HasSubstr("dropped bytes "));
  EXPECT_THAT(summary, Not(HasSubstr("dropped bytes 0")));
  EXPECT_THAT(read_file(err), HasSubstr("further collisions are only counted"));
}

TEST_F(Bushsim, ItsTraceSaysWhenItBegan) {
  timespec before{};
  ::clock_gettime(CLOCK_MONOTONIC, &before);
  start_ready();
  timespec after{};
  ::clock_gettime(CLOCK_MONOTONIC, &after);
  EXPECT_EQ(stop(), 0);
  const std::string text = read_file(trace);
  std::smatch said;
  ASSERT_TRUE(std::regex_search(
      text, said, std::regex("\\$comment time 0 is ([0-9]+) ns of CLOCK_MONOTONIC \\$end")));
  // The MCUs have booted before anybody is told: 20 ms of simulated time (kHeadStartNs).
  constexpr std::int64_t kHeadStartNs = 20'000'000;
  const std::int64_t begin_ns = std::stoll(said[1]) + kHeadStartNs;
  EXPECT_GE(begin_ns, before.tv_sec * 1'000'000'000 + before.tv_nsec);
  EXPECT_LE(begin_ns, after.tv_sec * 1'000'000'000 + after.tv_nsec);
}

TEST_F(Bushsim, BitErrorsSpoilFramesAndAreCounted) {
  // One of sixty bits, so most requests are spoilt. Which ones is up to the seed, and with this one
  // the first is.
  start({"--config", config, "--link", link, "--bit-errors", "0.0167", "--seed", "7"});
  ASSERT_TRUE(eventually([&] { return there(link); }));
  {
    const Port port(link);
    EXPECT_TRUE(eventually([&] {
      port.ask_who(1);
      pollfd ready{port.fd(), POLLIN, 0};
      return ::poll(&ready, 1, 1) == 1;
    })) << "no request came through";
  }
  EXPECT_EQ(stop(), 0);
  const std::string text = read_file(out);
  EXPECT_THAT(text, HasSubstr("bushsim: bits are flipped by --seed 7\n"));
  EXPECT_THAT(text, ContainsRegex("[1-9][0-9]* bits flipped"));
}

TEST_F(Bushsim, OfABusWithoutMcusTheAdapterIsNotSimulated) {
  const std::string pulses = bushd::test::source_path("tools/examples/serial-pulse.toml");
  for (const auto& [option, value] :
       {std::pair{"--latency-ms", "1"}, std::pair{"--bit-errors", "1e-3"}}) {
    EXPECT_THAT(refusal({"--config", pulses, "--link", link, option, value}),
                HasSubstr("leave out --latency-ms and --bit-errors"));
  }
}

TEST_F(Bushsim, AnswersPassAnAdapterWithALatencyTimer) {
  start_ready({"--latency-ms", "5"});
  const Port port(link);
  EXPECT_TRUE(port.identify(1));
  EXPECT_TRUE(port.identify(2));
  EXPECT_EQ(stop(), 0);
}

TEST_F(Bushsim, BootNumberDiffersFromStartToStart) {
  std::vector<std::uint16_t> numbers;
  for (int i = 0; i < 2; ++i) {
    start_ready();
    const auto identity = Port(link).identify(1);
    ASSERT_TRUE(identity);
    numbers.push_back(identity->boot_number);
    EXPECT_EQ(stop(), 0);
  }
  EXPECT_NE(numbers[0], numbers[1]);
}

TEST_F(Bushsim, ReplacesAStaleLinkAndLeavesAForeignOneAlone) {
  std::filesystem::create_symlink("/dev/null", link);
  start_ready();
  EXPECT_TRUE(Port(link).identify(1));
  std::filesystem::remove(link);
  std::filesystem::create_symlink("/dev/zero", link);
  EXPECT_EQ(stop(), 0);
  EXPECT_EQ(std::filesystem::read_symlink(link), "/dev/zero");
}

TEST_F(Bushsim, RefusesToReplaceWhatIsNoLink) {
  std::ofstream(link) << "precious";
  EXPECT_THAT(refusal({"--config", config, "--link", link}), HasSubstr(link));
  EXPECT_EQ(read_file(link), "precious");
}

TEST_F(Bushsim, SeveralBusesWantAChoice) {
  write_config({"hall", "roof"});
  const std::vector<std::string> arguments = {"--config", config, "--link", link};
  EXPECT_THAT(refusal(arguments), HasSubstr("choose with --bus: hall, roof"));
  auto with_bus = [&](const char* bus) {
    auto more = arguments;
    more.insert(more.end(), {"--bus", bus});
    return more;
  };
  EXPECT_THAT(refusal(with_bus("cellar")), HasSubstr("no bus \"cellar\""));
  start_ready({"--bus", "hall"});
  EXPECT_EQ(stop(), 0);
}

TEST_F(Bushsim, BadArgumentsAreRefusedWithTheirReason) {
  EXPECT_THAT(refusal({"--link", link}, 2), HasSubstr("--config is required"));
  EXPECT_THAT(refusal({"--config", folder + "/none.toml", "--link", link}), HasSubstr("none.toml"));
  EXPECT_THAT(refusal({"--config", config, "--link", folder + "/none/hall"}),
              HasSubstr("none/hall"));
  EXPECT_THAT(refusal({"--config", config, "--link", link, "--trace", folder + "/none/trace.vcd"}),
              HasSubstr("none/trace.vcd"));
  EXPECT_THAT(refusal({"--config", config, "--link", link, "--boot-number", "65536"}, 2),
              HasSubstr("--boot-number"));
  EXPECT_THAT(refusal({"--config", config, "--link", link, "--seed", "7"}, 2),
              HasSubstr("--bit-errors"));
  EXPECT_FALSE(there(link)) << "what failed must not leave a link behind";
}

}  // namespace

// The real thing: a pty of the kernel, opened through libserial.
#include "bus/port/serial_port.h"

#include <fcntl.h>
#include <gmock/gmock.h>
#include <poll.h>
#include <pty.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <numeric>
#include <string>

#include "bus/port/any_rate.h"

namespace bushd::serial {
namespace {

using testing::HasSubstr;

class Pty : public testing::Test {
 protected:
  void SetUp() override {
    std::array<char, 128> name;
    ASSERT_EQ(::openpty(&master_, &slave_, name.data(), nullptr, nullptr), 0);
    path_ = name.data();
  }
  void TearDown() override { hang_up(); }
  void hang_up() {
    if (slave_ >= 0) ::close(slave_);
    if (master_ >= 0) ::close(master_);
    slave_ = master_ = -1;
  }
  static bool wait(int fd, short events) {
    pollfd poll{fd, events, 0};
    return ::poll(&poll, 1, 5000) == 1;
  }
  std::vector<std::uint8_t> read_master(std::size_t size) {
    std::vector<std::uint8_t> bytes;
    while (bytes.size() < size && wait(master_, POLLIN)) {
      std::array<std::uint8_t, 4096> buffer;
      const ssize_t n =
          ::read(master_, buffer.data(), std::min(buffer.size(), size - bytes.size()));
      if (n <= 0) break;
      bytes.insert(bytes.end(), buffer.begin(), buffer.begin() + n);
    }
    return bytes;
  }
  std::vector<std::uint8_t> read_port(SerialPort& port, std::size_t size) {
    std::vector<std::uint8_t> bytes;
    while (bytes.size() < size && wait(port.fd(), POLLIN)) {
      if (!port.read(bytes)) break;
    }
    return bytes;
  }
  SerialPort open() {
    auto port = SerialPort::open(path_, 500'000);
    if (!port) throw std::runtime_error(port.error().text());
    return std::move(*port);
  }

  int master_ = -1;
  int slave_ = -1;
  std::string path_;
};

// Before it is opened: a pattern such as /dev/tty* has the terminals of people among its matches.
TEST(SerialPort, ConsolesAreRefused) {
  unsigned there = 0;
  for (const char* path : {"/dev/tty", "/dev/tty0", "/dev/tty1", "/dev/console", "/dev/ptmx"}) {
    struct stat status{};
    if (::stat(path, &status) != 0 || major(status.st_rdev) == 0) continue;
    // In a container the console may be a pty.
    if (major(status.st_rdev) != 4 && major(status.st_rdev) != 5) continue;
    ++there;
    const auto port = SerialPort::open(path, 9600);
    ASSERT_FALSE(port) << path;
    EXPECT_NE(port.error().text().find("is a console"), std::string::npos) << port.error().text();
  }
  EXPECT_GT(there, 0u) << "every Linux has /dev/tty";
}

TEST_F(Pty, IsSetToRaw8N1AtTheRateAsked) {
  const struct {
    std::uint32_t baud;
    speed_t speed;
  } rates[] = {{9600, B9600},
               {115200, B115200},
               {500'000, B500000},
               {1'000'000, B1000000},
               {4'000'000, B4000000}};
  for (const auto& rate : rates) {
    const auto port = SerialPort::open(path_, rate.baud);
    ASSERT_TRUE(port) << port.error().text();
    termios settings{};
    ASSERT_EQ(::tcgetattr(port->fd(), &settings), 0);
    EXPECT_EQ(::cfgetospeed(&settings), rate.speed);
    EXPECT_EQ(::cfgetispeed(&settings), rate.speed);
    EXPECT_EQ(settings.c_cflag & CSIZE, tcflag_t{CS8});
    EXPECT_EQ(settings.c_cflag & (PARENB | CSTOPB | CRTSCTS), 0u);
    EXPECT_NE(settings.c_cflag & CREAD, 0u);
    EXPECT_EQ(settings.c_iflag &
                  (IXON | IXOFF | ICRNL | INLCR | IGNCR | ISTRIP | INPCK | BRKINT | PARMRK),
              0u);
    EXPECT_EQ(settings.c_oflag & OPOST, 0u);
    EXPECT_EQ(settings.c_lflag & (ICANON | ECHO | ECHONL | ISIG | IEXTEN), 0u);
    EXPECT_NE(::fcntl(port->fd(), F_GETFL) & O_NONBLOCK, 0);
    EXPECT_NE(::fcntl(port->fd(), F_GETFD) & FD_CLOEXEC, 0) << "not handed to programs started";
  }
}

TEST_F(Pty, EveryByteValuePassesUnchangedBothWays) {
  SerialPort port = open();
  std::vector<std::uint8_t> all(512);
  std::iota(all.begin(), all.end(), std::uint8_t{0});
  for (const std::uint8_t special :
       std::initializer_list<std::uint8_t>{0x00, 0x03, 0x11, 0x13, 0x0D, 0x0A, 0x1A, 0x7F, 0xFF}) {
    all.insert(all.end(), {special, special});
  }
  ASSERT_TRUE(port.write(all));
  EXPECT_FALSE(port.wants_to_write());
  EXPECT_EQ(read_master(all.size()), all);
  ASSERT_EQ(::write(master_, all.data(), all.size()), static_cast<ssize_t>(all.size()));
  EXPECT_EQ(read_port(port, all.size()), all);
}

TEST_F(Pty, NothingThereIsNoErrorAndDoesNotBlock) {
  SerialPort port = open();
  std::vector<std::uint8_t> bytes = {42};
  EXPECT_TRUE(port.read(bytes));
  EXPECT_EQ(bytes, std::vector<std::uint8_t>{42});
  ASSERT_EQ(::write(master_, "ab", 2), 2);
  ASSERT_TRUE(wait(port.fd(), POLLIN));
  EXPECT_TRUE(port.read(bytes));
  EXPECT_EQ(bytes, (std::vector<std::uint8_t>{42, 'a', 'b'})) << "appended";
}

TEST_F(Pty, WhatCameBeforeItWasOpenedIsForgotten) {
  ASSERT_EQ(::write(master_, "old\n", 4), 4);
  SerialPort port = open();
  std::vector<std::uint8_t> bytes;
  EXPECT_TRUE(port.read(bytes));
  EXPECT_TRUE(bytes.empty());
}

TEST_F(Pty, HangUpIsAnErrorAndThePortCanBeDestroyed) {
  SerialPort port = open();
  hang_up();
  ASSERT_TRUE(wait(port.fd(), POLLIN));
  std::vector<std::uint8_t> bytes;
  const auto read = port.read(bytes);
  ASSERT_FALSE(read);
  EXPECT_FALSE(read.error().message.empty());
  EXPECT_FALSE(port.write(std::vector<std::uint8_t>{1, 2, 3}));
}

TEST_F(Pty, SecondOpenIsRefusedUntilTheFirstIsGone) {
  {
    const SerialPort first = open();
    const auto second = SerialPort::open(path_, 500'000);
    ASSERT_FALSE(second);
    EXPECT_THAT(second.error().text(), HasSubstr("in use"));
    EXPECT_THAT(second.error().text(), HasSubstr(path_));
  }
  EXPECT_TRUE(SerialPort::open(path_, 500'000));
}

// The refused second opener must not have changed the line of the first, nor eaten its bytes.
TEST_F(Pty, RefusedOpenLeavesThePortAsItWas) {
  SerialPort first = open();
  ASSERT_EQ(::write(master_, "\x11\x13", 2), 2);
  ASSERT_TRUE(wait(first.fd(), POLLIN));
  ASSERT_FALSE(SerialPort::open(path_, 9600));
  termios settings{};
  ASSERT_EQ(::tcgetattr(first.fd(), &settings), 0);
  EXPECT_EQ(::cfgetospeed(&settings), speed_t{B500000});
  EXPECT_EQ(read_port(first, 2), (std::vector<std::uint8_t>{0x11, 0x13}));
}

TEST_F(Pty, FullLineDoesNotBlockAndNothingIsLost) {
  SerialPort port = open();
  std::vector<std::uint8_t> sent;
  std::uint8_t next = 0;
  while (!port.wants_to_write()) {
    std::vector<std::uint8_t> part(1000);
    for (std::uint8_t& byte : part) byte = next++;
    ASSERT_TRUE(port.write(part));
    sent.insert(sent.end(), part.begin(), part.end());
    ASSERT_LT(sent.size(), 1u << 20) << "a pty takes only so much";
  }
  ASSERT_TRUE(port.write(std::vector<std::uint8_t>{1, 2, 3}));
  sent.insert(sent.end(), {1, 2, 3});
  std::vector<std::uint8_t> seen;
  while (seen.size() < sent.size()) {
    const auto part = read_master(std::min<std::size_t>(1000, sent.size() - seen.size()));
    ASSERT_FALSE(part.empty());
    seen.insert(seen.end(), part.begin(), part.end());
    ASSERT_TRUE(port.flush());
  }
  EXPECT_EQ(seen, sent);
  EXPECT_FALSE(port.wants_to_write());
}

TEST_F(Pty, LineThatTakesNothingForLongIsAnError) {
  SerialPort port = open();
  const std::vector<std::uint8_t> part(1000);
  bool refused = false;
  for (int i = 0; i < 1000 && !refused; ++i) refused = !port.write(part);
  EXPECT_TRUE(refused) << "memory does not grow for ever";
}

TEST_F(Pty, MovedFromPortOwnsNothing) {
  SerialPort first = open();
  const int fd = first.fd();
  SerialPort second = std::move(first);
  EXPECT_EQ(second.fd(), fd);
  ASSERT_TRUE(second.write(std::vector<std::uint8_t>{9}));
  EXPECT_EQ(read_master(1), std::vector<std::uint8_t>{9});
  SerialPort third = std::move(second);
  SerialPort& same = third;
  third = std::move(same);
  EXPECT_EQ(third.fd(), fd);
}

TEST(SerialPort, WhatIsNoPortIsSaidClearly) {
  const auto missing = SerialPort::open("/dev/does-not-exist", 500'000);
  ASSERT_FALSE(missing);
  EXPECT_THAT(missing.error().text(), HasSubstr("/dev/does-not-exist"));
  EXPECT_THAT(missing.error().text(), HasSubstr("No such file"));
  const auto null = SerialPort::open("/dev/null", 500'000);
  ASSERT_FALSE(null);
  EXPECT_THAT(null.error().text(), HasSubstr("no serial port"));
  const auto directory = SerialPort::open("/", 500'000);
  ASSERT_FALSE(directory);
  EXPECT_THAT(directory.error().text(), HasSubstr("cannot be opened"));
  const auto file =
      std::filesystem::temp_directory_path() / ("bushd-no-port-" + std::to_string(::getpid()));
  std::ofstream(file) << "text";
  const auto plain = SerialPort::open(file.string(), 500'000);
  ASSERT_FALSE(plain);
  EXPECT_THAT(plain.error().text(), HasSubstr("no serial port"));
  std::filesystem::remove(file);
}

TEST_F(Pty, UnknownRateIsRefused) {
  const auto port = SerialPort::open(path_, 123'456);
  ASSERT_FALSE(port);
  EXPECT_THAT(port.error().text(), HasSubstr("123456 baud"));
}

// Keypads of the source documents talk at 625 baud, which POSIX does not have.
TEST_F(Pty, OpensAtAnyRate) {
  for (const std::uint32_t baud : {625u, 9600u, 123'456u}) {
    const auto port = SerialPort::open_any_rate(path_, baud);
    ASSERT_TRUE(port) << port.error().text();
    EXPECT_EQ(rate_of(master_), baud);
  }
}

}  // namespace
}  // namespace bushd::serial

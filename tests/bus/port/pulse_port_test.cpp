// A pty of the kernel as a port for pulses, with simulated modem lines at a socket beside it.
#include "bus/port/pulse_port.h"

#include <gmock/gmock.h>
#include <poll.h>
#include <pty.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cstring>
#include <filesystem>

#include "bus/port/any_rate.h"

namespace bushd::serial {
namespace {

using testing::HasSubstr;

class PulsePortTest : public testing::Test {
 protected:
  void SetUp() override {
    std::array<char, 128> name{};
    ASSERT_EQ(::openpty(&master_, &slave_, name.data(), nullptr, nullptr), 0);
    folder_ = std::filesystem::temp_directory_path() / ("pulse-" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    path_ = folder_ / "port";
    std::filesystem::create_symlink(name.data(), path_);
  }
  void TearDown() override {
    for (const int fd : {master_, slave_, listener_, client_}) {
      if (fd >= 0) ::close(fd);
    }
    std::filesystem::remove_all(folder_);
  }
  void listen() {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    std::strcpy(address.sun_path, LineSocket::path_of(path_).c_str());
    listener_ = ::socket(AF_UNIX, SOCK_SEQPACKET, 0);
    ASSERT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    ASSERT_EQ(::listen(listener_, 1), 0);
  }
  // What the port has ordered next, answered by this.
  LineOrder answer(const LineState& state) {
    if (client_ < 0) client_ = ::accept(listener_, nullptr, nullptr);
    LineOrder order;
    EXPECT_EQ(::recv(client_, &order, sizeof order, 0), ssize_t{sizeof order});
    EXPECT_EQ(::send(client_, &state, sizeof state, 0), ssize_t{sizeof state});
    return order;
  }

  int master_ = -1;
  int slave_ = -1;
  int listener_ = -1;
  int client_ = -1;
  std::filesystem::path folder_;
  std::string path_;
};

TEST_F(PulsePortTest, RefusesAPtyWithoutModemLines) {
  const auto port = PulsePort::open(path_, {});
  ASSERT_FALSE(port);
  EXPECT_THAT(port.error().text(), HasSubstr("has no modem lines"));
  EXPECT_THAT(port.error().text(), HasSubstr(path_ + ".lines"));
}

TEST_F(PulsePortTest, MakesAnyRateAndSaysWhichOne) {
  listen();
  auto port = PulsePort::open(path_, {});
  ASSERT_TRUE(port) << port.error().text();
  EXPECT_TRUE(port->any_rate());
  answer({});
  for (const std::uint32_t baud : {50u, 1234u, 9600u, 31'415u}) {
    ASSERT_TRUE(port->set_baud(baud));
    EXPECT_EQ(port->status()->baud, baud);
    EXPECT_EQ(rate_of(master_), baud);  // as the other end of a pty sees it
  }
}

TEST_F(PulsePortTest, TellsLinesAndWhatHasLeft) {
  listen();
  auto port = PulsePort::open(path_, {.rts = true, .positive_off = false});
  ASSERT_TRUE(port) << port.error().text();
  EXPECT_FALSE(port->status()->empty.has_value());  // nothing is known yet
  EXPECT_GT(port->status()->queued, 0u);
  EXPECT_EQ(answer({}).sets, 0);
  const std::array<std::uint8_t, 3> bytes = {0x55, 0x55, 0xFF};
  ASSERT_TRUE(port->set_positive(true));
  ASSERT_TRUE(port->write(bytes));
  std::array<std::uint8_t, 8> read{};
  ASSERT_EQ(::read(master_, read.data(), read.size()), 3);
  EXPECT_EQ(read[2], 0xFF);
  answer({});
  answer({});
  const LineOrder order = answer({.lines = 5, .direction_on = 1, .unused = {}, .left = 2});
  EXPECT_EQ(order.sets, 1);
  EXPECT_EQ(order.direction_on, 1);
  auto status = port->status();
  EXPECT_EQ(status->queued, 1u);
  EXPECT_EQ(status->empty, false);
  EXPECT_EQ(status->lines, 5);
  EXPECT_EQ(status->positive, true);
  answer({.lines = 0, .direction_on = 1, .unused = {}, .left = 3});
  status = port->status();
  EXPECT_EQ(status->queued, 0u);
  EXPECT_EQ(status->empty, true);
}

TEST_F(PulsePortTest, DirectionLineMayBeOffInThePositiveDirection) {
  listen();
  auto port = PulsePort::open(path_, {.rts = false, .positive_off = true});
  ASSERT_TRUE(port) << port.error().text();
  answer({});
  ASSERT_TRUE(port->set_positive(true));
  const LineOrder order = answer({.lines = 0, .direction_on = 0, .unused = {}, .left = 0});
  EXPECT_EQ(order.sets, 1);
  EXPECT_EQ(order.direction_on, 0);
  EXPECT_EQ(port->status()->positive, true);
}

TEST_F(PulsePortTest, SaysThatItsLinesAreGone) {
  listen();
  auto port = PulsePort::open(path_, {});
  ASSERT_TRUE(port) << port.error().text();
  answer({});
  ::close(client_);
  client_ = -1;
  const auto status = port->status();
  ASSERT_FALSE(status);
  EXPECT_THAT(status.error().text(), HasSubstr("modem lines are gone"));
}

}  // namespace
}  // namespace bushd::serial

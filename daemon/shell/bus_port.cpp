#include "daemon/shell/bus_port.h"

#include <algorithm>
#include <optional>
#include <string>
#include <utility>

#include "bus/port/pulse_port.h"
#include "bus/port/serial_port.h"
#include "config/port_pattern.h"

namespace bushd::daemon {
namespace {

class BytePort final : public BusPort {
 public:
  BytePort(serial::SerialPort port, std::uint32_t baud) : port_(std::move(port)), baud_(baud) {}
  int fd() const override { return port_.fd(); }
  const std::string& path() const override { return port_.path(); }
  std::string text() const override { return "at " + std::to_string(baud_) + " baud"; }
  Result<void> read(std::vector<std::uint8_t>& bytes) override { return port_.read(bytes); }
  Result<void> write(std::span<const std::uint8_t> bytes) override { return port_.write(bytes); }
  Result<void> flush() override { return port_.flush(); }
  bool wants_to_write() const override { return port_.wants_to_write(); }

 private:
  serial::SerialPort port_;
  std::uint32_t baud_;
};

class PulsePort final : public BusPort {
 public:
  explicit PulsePort(serial::PulsePort port) : port_(std::move(port)) {}
  int fd() const override { return port_.fd(); }
  const std::string& path() const override { return port_.path(); }
  std::string text() const override {
    return port_.any_rate() ? "for pulses, at any rate" : "for pulses, at fixed rates";
  }
  Result<void> read(std::vector<std::uint8_t>&) override { return port_.discard_input(); }
  Result<void> write(std::span<const std::uint8_t> bytes) override { return port_.write(bytes); }
  Result<link::PulseStatus> carry_out(const link::PulseOrder& order) override {
    if (order.positive) {
      if (auto set = port_.set_positive(*order.positive); !set) return fail(set.error());
    }
    if (order.baud) {
      if (auto set = port_.set_baud(*order.baud); !set) return fail(set.error());
    }
    if (auto written = port_.write(order.bytes); !written) return fail(written.error());
    const auto status = port_.status();
    if (!status) return fail(status.error());
    return link::PulseStatus{.any_rate = port_.any_rate(),
                             .base = port_.divided_base(),
                             .baud = status->baud,
                             .queued = status->queued,
                             .empty = status->empty,
                             .lines = status->lines,
                             .positive = status->positive};
  }

 private:
  serial::PulsePort port_;
};

Result<std::unique_ptr<BusPort>> open_port(const std::string& path, const config::Bus& bus) {
  switch (bus.kind) {
    case config::BusKind::kSerialPulse: {
      auto opened = serial::PulsePort::open(
          path, {.rts = bus.serial_pulse.rts, .positive_off = bus.serial_pulse.positive_off});
      if (!opened) return fail(opened.error());
      return std::make_unique<PulsePort>(std::move(*opened));
    }
    case config::BusKind::kRs485:
    case config::BusKind::kCommutator:
      break;
  }
  auto opened = serial::SerialPort::open(path, bus.baud);
  if (!opened) return fail(opened.error());
  return std::make_unique<BytePort>(std::move(*opened), bus.baud);
}

}  // namespace

Result<std::unique_ptr<BusPort>> open_first_port(const config::Bus& bus, const PortOrder& order,
                                                 const std::vector<PortInUse>& in_use) {
  std::optional<Error> first_error;
  for (const std::string& path : in_order(config::ports_matching(bus.port), order)) {
    const auto other = std::ranges::find_if(
        in_use, [&path](const PortInUse& port) { return config::is_same_port(port.path, path); });
    if (other != in_use.end()) {
      if (!first_error) first_error = {.message = "is open for " + other->user, .file = path};
      continue;
    }
    auto opened = open_port(path, bus);
    if (opened) return opened;
    if (!first_error) first_error = opened.error();
  }
  if (first_error) return fail(*first_error);
  return fail(Error{.message = "no port matches", .file = bus.port});
}

}  // namespace bushd::daemon

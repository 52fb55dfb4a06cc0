#include "sim/bus.h"

#include <algorithm>
#include <cassert>

namespace bushd::sim {
namespace {

// How far a sink may have to wait for edges (and so to buffer) while time is moved in great
// strides.
constexpr TimeNs kSettlingPeriodNs = 10'000'000;

}  // namespace

Bus::Bus(std::uint32_t baud, EdgeSink* sink) : baud_(baud), sink_(sink), wire_(baud) {
  wire_.add_talker();
}

std::size_t Bus::add_mcu(const McuOptions& options) {
  assert(options.boot_ns >= now_ns_);
  return add_mcu([&options](std::size_t index, Mcu::Driver& driver, EdgeSink* sink) {
    return std::make_unique<VirtualMcu>(options, index, driver, sink);
  });
}

std::size_t Bus::add_mcu(const MakeMcu& make) {
  assert(second_master_ == kMaster);
  const std::size_t index = mcus_.size();
  wire_.add_talker();
  deaf_until_ns_.push_back(0);
  Mcu::Driver& driver = *this;  // here, where the private base is known
  mcus_.push_back(make(index, driver, sink_));
  return index;
}

void Bus::master_send(std::span<const std::uint8_t> bytes, TimeNs at_ns) {
  assert(at_ns >= now_ns_);
  wire_.send(kMaster, bytes, at_ns);
}

void Bus::add_second_master() {
  assert(second_master_ == kMaster);
  second_master_ = wire_.add_talker();
}

void Bus::second_master_send(std::span<const std::uint8_t> bytes, TimeNs at_ns) {
  assert(second_master_ != kMaster && at_ns >= now_ns_);
  wire_.send(second_master_, bytes, at_ns);
}

void Bus::transmit(std::size_t mcu, TimeNs start_ns, const std::uint8_t* wire, std::size_t size) {
  wire_.send(mcu + 1, {wire, size}, start_ns);
}

std::uint8_t Bus::talker_address(std::size_t talker) const {
  return talker == kMaster || talker == second_master_ ? BUSHD_ADDRESS_BROADCAST
                                                       : mcus_[talker - 1]->address();
}

TimeNs Bus::next_event_ns() const {
  TimeNs next_ns = wire_.next_end_ns();
  for (const auto& mcu : mcus_) next_ns = std::min(next_ns, mcu->next_event_ns());
  return next_ns;
}

// How far time can move on, until_ns at most, so that nobody begins to speak before.
TimeNs Bus::stride(TimeNs until_ns) {
  const auto may_speak = [](const auto& mcu) { return mcu->may_speak(); };
  const auto first = std::ranges::find_if(mcus_, may_speak);
  if (first == mcus_.end()) return until_ns;
  if (std::none_of(first + 1, mcus_.end(), may_speak)) {
    const TimeNs reached_ns = (*first)->advance_until_it_speaks(until_ns);
    if (reached_ns > now_ns_) return reached_ns;
  }
  // Half a byte: none that an unforeseen answer begins with within it can end in it.
  return std::min(until_ns, now_ns_ + kBitsPerByte * 1'000'000'000 / 2 / baud_);
}

// Ticks of different MCUs touch nothing in common, so that only those of one MCU need be in order.
void Bus::run_ticks_until(TimeNs t_ns) {
  for (const auto& mcu : mcus_) {
    if (mcu->next_event_ns() <= t_ns) mcu->advance(t_ns);
  }
}

void Bus::deliver(const WireByte& byte) {
  corrupted_bytes_ += byte.corrupted;
  if (byte.collision) {
    ++collisions_;
    if (on_collision) {
      on_collision(byte.collision->time_ns, talker_address(byte.collision->talker[0]),
                   talker_address(byte.collision->talker[1]));
    }
  }
  for (std::size_t i = 0; i < mcus_.size(); ++i) {
    const std::size_t talker = i + 1;
    if (talker == byte.talker || wire_.drives(talker, byte.start_ns, byte.end_ns)) continue;
    if (byte.end_ns <= deaf_until_ns_[i]) continue;
    mcus_[i]->receive(byte.value, byte.end_ns);
    if (on_mcu_byte && mcus_[i]->running()) on_mcu_byte(i, byte.value, byte.end_ns);
  }
  if (byte.talker != kMaster && on_master_byte) on_master_byte(byte.value, byte.end_ns);
  if (byte.talker != second_master_ && on_second_master_byte) {
    on_second_master_byte(byte.value, byte.end_ns);
  }
}

void Bus::settle(TimeNs t_ns) {
  for (const auto& mcu : mcus_) mcu->advance(t_ns);
  if (sink_ != nullptr) sink_->settled(t_ns);
  next_settling_ns_ = t_ns + kSettlingPeriodNs;
}

void Bus::advance_to(TimeNs t_ns) {
  assert(t_ns >= now_ns_);
  for (;;) {
    const TimeNs end_ns = wire_.next_end_ns();
    if (sink_ != nullptr && next_settling_ns_ <= now_ns_) settle(now_ns_);
    const TimeNs limit_ns = std::min(end_ns, t_ns);
    const TimeNs until_ns =
        stride(sink_ != nullptr ? std::min(limit_ns, next_settling_ns_) : limit_ns);
    run_ticks_until(until_ns);
    now_ns_ = until_ns;
    if (end_ns <= until_ns) {
      deliver(wire_.take());
    } else if (until_ns == t_ns) {
      break;
    }
  }
  settle(t_ns);
}

void Bus::deafen(std::size_t mcu, TimeNs until_ns) {
  deaf_until_ns_[mcu] = std::max(deaf_until_ns_[mcu], until_ns);
}

void Bus::reboot(std::size_t mcu, TimeNs down_ns) {
  Mcu& rebooted = *mcus_[mcu];
  wire_.silence(mcu + 1, now_ns_);
  rebooted.reset(now_ns_, now_ns_ + down_ns,
                 static_cast<std::uint16_t>(rebooted.boot_number() + 1));
}

}  // namespace bushd::sim

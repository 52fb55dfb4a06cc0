#include "sim/avr/avr_node.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "sim/avr/avr_chip.h"

extern "C" {
#include <avr_ioport.h>
#include <sim_avr.h>
#include <sim_cycle_timers.h>
#include <sim_io.h>
}

namespace bushd::sim {
namespace {

avr_cycle_count_t stop_here(avr_t*, avr_cycle_count_t, void*) {
  return 0;
}

}  // namespace

AvrNode::AvrNode(const std::string& image, Sent sent)
    : avr_(load_avr(image, "atmega328p").avr),
      line_(std::make_unique<AvrUartLine>(
          avr_, '0', [sent = std::move(sent)](std::uint64_t end_cycle, std::uint8_t byte) {
            sent(ns_of_cycles(end_cycle), byte);
          })) {}

AvrNode::~AvrNode() {
  free_avr(avr_);
}

TimeNs AvrNode::time_ns() const {
  return ns_of_cycles(avr_->cycle);
}

void AvrNode::advance(TimeNs now_ns) {
  while (time_ns() < now_ns) {
    line_->step();
    const auto left = static_cast<avr_cycle_count_t>((now_ns - time_ns()) * 2 / 125 + 1);
    avr_->run_cycle_limit = left;
    // With each WDR simavr forgets how far it was to go on, but for its timers.
    avr_cycle_timer_register(avr_, left, stop_here, this);
    avr_->run_cycle_count = std::min(avr_->run_cycle_count, left);
    if (avr_run(avr_) == cpu_Crashed) {
      throw std::runtime_error("simavr: the node's image has crashed");
    }
  }
}

void AvrNode::watch(char port, int bit, Notify notify, void* param) {
  avr_irq_register_notify(
      avr_io_getirq(avr_, AVR_IOCTL_IOPORT_GETIRQ(static_cast<unsigned>(port)), bit), notify,
      param);
}

void AvrNode::wake_at(TimeNs time_ns, Wake wake, void* param) {
  const TimeNs wait_ns = std::max(time_ns - this->time_ns(), TimeNs{0});
  avr_cycle_timer_register(avr_, std::max(cycles_of_ns(wait_ns), std::uint64_t{1}), wake, param);
}

// For what the image reads, and for what simavr makes of the pins when the image writes to them.
void AvrNode::drive(char port, std::uint8_t mask, std::uint8_t levels, std::uint8_t counting) {
  avr_ioport_external_t external{};
  external.name = port & 0x7F;
  external.mask = mask;
  external.value = levels & mask;
  avr_ioctl(avr_, AVR_IOCTL_IOPORT_SET_EXTERNAL(static_cast<unsigned>(port)), &external);
  for (int bit = 0; bit < 8; ++bit) {
    if ((mask >> bit & 1) == 0) continue;
    const std::uint32_t level = levels >> bit & 1;
    avr_irq_t* const pin =
        avr_io_getirq(avr_, AVR_IOCTL_IOPORT_GETIRQ(static_cast<unsigned>(port)), bit);
    // After a reset the register has lost a level of which simavr thinks that it is told already.
    if ((counting >> bit & 1) == 0) pin->value = level ^ 1;
    avr_raise_irq(pin, level);
  }
}

void AvrNode::hang() {
  jump_into_endless_loop(avr_);
}

}  // namespace bushd::sim

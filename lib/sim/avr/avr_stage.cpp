// The power stage at the pins of an AvrMcu: transistors, comparators, and the reference that a PWM
// makes through a low-pass.
extern "C" {
#include <avr_ioport.h>
#include <avr_timer.h>
#include <sim_avr.h>
#include <sim_cycle_timers.h>
}

#include <algorithm>
#include <cmath>

#include "sim/avr/avr_mcu.h"

namespace bushd::sim {
namespace {

constexpr AvrPin kComparators[] = {{'D', 2}, {'D', 3}};
constexpr AvrPin kDecay = {'A', 7};
constexpr double kFullScaleA = 5.11;  // of an output that is always high
// Timer 2 in the address space of data (data sheet, "Register Summary").
constexpr std::size_t kTccr2a = 0xB0;
constexpr std::size_t kTccr2b = 0xB1;
constexpr std::size_t kOcr2a = 0xB3;
// The time constant of the low-pass, which has one pole: a new reference is there to 1 % within a
// tick.
constexpr double kFilterNs = 300'000;
constexpr TimeNs kSampleNs = 5'000;
constexpr double kSampleA = 0.001;  // less is not told

// The share of time for which OC2A is high, by the data sheet ("8-bit Timer/Counter2 with PWM"):
// in fast PWM up to 255 (WGM22:0 = 3) that does not invert (COM2A1:0 = 2) it is set at BOTTOM and
// cleared behind the compare match, so for OCR2A + 1 of 256 counts; with 0 as "a narrow spike". The
// stage knows no other mode; without one the pin is low.
double high_share(const avr_t& avr) {
  const bool pwm = (avr.data[kTccr2a] & 0xC3) == 0x83 && (avr.data[kTccr2b] & 0x08) == 0;
  const bool runs = (avr.data[kTccr2b] & 0x07) != 0;
  return pwm && runs ? (avr.data[kOcr2a] + 1) / 256.0 : 0;
}

}  // namespace

void AvrMcu::begin_stage(const PowerStageRules& rules) {
  stage_.emplace(Stage{PowerStage(rules)});
  watch_pin(kDecay, call<&AvrMcu::on_decay>, this);
  avr_irq_register_notify(avr_io_getirq(avr_, AVR_IOCTL_TIMER_GETIRQ('2'), TIMER_IRQ_OUT_PWM0),
                          call<&AvrMcu::on_reference>, this);
  for (const AvrPin& pin : kComparators) drive(pin, true);
  avr_cycle_timer_register(avr_, 1, on_stage_time, this);
}

// Time goes on to now: reference, currents, comparators.
void AvrMcu::follow_stage() {
  PowerStage& stage = stage_->stage;
  const TimeNs now_ns = std::max(time_ns(), stage_->followed_ns);
  const double target_a = stage_->high_share * kFullScaleA;
  const auto passed_ns = static_cast<double>(now_ns - stage_->followed_ns);
  stage.set_reference(
      now_ns, target_a + (stage.reference_a() - target_a) * std::exp(-passed_ns / kFilterNs));
  stage_->followed_ns = now_ns;
  for (std::size_t pair = 0; pair < PowerStage::kPairs; ++pair) {
    const bool trips = stage.trips(pair);
    if (trips == stage_->trips[pair]) continue;
    stage_->trips[pair] = trips;
    drive(kComparators[pair], !trips);
  }
  if (sink_ == nullptr) return;
  for (std::uint8_t w = 0; w < PowerStage::kWindings; ++w) {
    double& told_a = stage_->told_a[w];
    const double current_a = stage.current_a(w);
    const bool same = std::abs(current_a - told_a) < kSampleA && (current_a == 0) == (told_a == 0);
    if (same) continue;
    told_a = current_a;
    sink_->sample({now_ns, index_, w, current_a});
  }
}

void AvrMcu::stage_output(std::uint8_t winding, bool level) {
  follow_stage();
  const auto bit = static_cast<std::uint8_t>(1 << winding);
  const std::uint8_t before = stage_->stage.outputs();
  const auto outputs = static_cast<std::uint8_t>(level ? before | bit : before & ~bit);
  stage_->stage.set_outputs(stage_->followed_ns, outputs);
  follow_stage();
  // It may trip sooner than was planned for.
  avr_cycle_timer_register(avr_, 1, on_stage_time, this);
}

// Comes when the next comparator trips, or every few us.
std::uint64_t AvrMcu::on_stage_time(avr_t*, std::uint64_t when, void* param) {
  auto& self = *static_cast<AvrMcu*>(param);
  self.follow_stage();
  const PowerStage& stage = self.stage_->stage;
  const bool rests = stage.outputs() == 0 && stage.current_a(0) == 0 && stage.current_a(1) == 0 &&
                     stage.current_a(2) == 0 && stage.current_a(3) == 0;
  TimeNs next_ns = rests ? 20 * kSampleNs : kSampleNs;
  for (std::size_t pair = 0; pair < PowerStage::kPairs; ++pair) {
    const auto trip_ns = stage.next_trip_ns(pair, kSampleNs);
    if (trip_ns) next_ns = std::min(next_ns, *trip_ns - self.stage_->followed_ns);
  }
  return when + std::max(std::uint64_t{1}, cycles_of_ns(std::max(next_ns, TimeNs{0})));
}

void AvrMcu::on_decay(std::uint32_t level) {
  follow_stage();
  stage_->stage.set_fast_decay(stage_->followed_ns, (level & 1) != 0);
}

void AvrMcu::on_reference(std::uint32_t) {
  follow_stage();
  stage_->high_share = high_share(*avr_);
}

}  // namespace bushd::sim

#include "overheard.h"

#include "engine/message.h"

namespace bushfaults {

Overheard::Overheard(bushd::sim::Bus& bus, bushd::sim::Plant& plant, Skew& skew, Witness& witness)
    : bus_(bus), plant_(plant), skew_(skew), witness_(witness), receiver_(bus.mcu_count()) {
  bus_.on_mcu_byte = [this](std::size_t mcu, std::uint8_t byte, TimeNs end_ns) {
    bushd_frame heard;
    if (bushd_receive_byte(&receiver_[mcu], byte, &heard) != BUSHD_RECEIVE_FRAME) return;
    frame(end_ns, mcu, heard);
  };
}

Overheard::~Overheard() {
  bus_.on_mcu_byte = nullptr;
}

void Overheard::frame(TimeNs now_ns, std::size_t mcu, const bushd_frame& frame) {
  const bool for_it =
      frame.address == BUSHD_ADDRESS_BROADCAST || frame.address == bus_.mcu(mcu).address();
  if (!for_it) return;
  witness_.is_heard(now_ns, mcu);
  if (frame.type == BUSHD_MSG_SYNC) {
    bushd_sync sync;
    if (bushd_decode_sync(frame.payload, frame.payload_size, &sync) != BUSHD_OK) return;
    skew_.heard(now_ns, mcu, sync);
  } else if (frame.type == BUSHD_MSG_POLL) {
    bushd_poll poll;
    bushd_poll_entry entry;
    if (bushd_decode_poll(frame.payload, frame.payload_size, &poll) != BUSHD_OK) return;
    if (bushd_poll_find(&poll, bus_.mcu(mcu).address(), &entry))
      witness_.positions().reported(now_ns, mcu);
  } else if (frame.type == BUSHD_MSG_EMERGENCY) {
    bushd_emergency emergency;
    if (bushd_decode_emergency(frame.payload, frame.payload_size, &emergency) != BUSHD_OK) return;
    plant_.halt(mcu, now_ns, emergency.mode != BUSHD_STOP_RAMP);
  } else if (frame.type == BUSHD_MSG_CONTROL) {
    bushd_control control;
    if (bushd_decode_control(frame.payload, frame.payload_size, &control) != BUSHD_OK) return;
    if ((control.actions & BUSHD_CONTROL_CLEAR_FAULTS) == 0) return;
    // It refuses while a motor moves.
    const unsigned halts = BUSHD_FAULT_EMERGENCY | BUSHD_FAULT_EMERGENCY_INPUT;
    if ((bus_.mcu(mcu).core().faults & halts) == 0) plant_.release(mcu);
  }
}

}  // namespace bushfaults

// Random streams for the image for ATmega2560.
#include "sim/random_streams.h"

#include "sim/avr/avr_mcu.h"

namespace bushd::sim::random_streams_test {
namespace {

class AvrRandomStreams : public RandomStreams {
 protected:
  AvrRandomStreams()
      : RandomStreams(200'000'000, mcu_of<AvrMcu>(AvrOptions{.image = AVR_IMAGES "-1000000.elf",
                                                             .address = kAddress,
                                                             .unique_id = 0x1122334455667788,
                                                             .memory_owners = AVR_MEMORY_OWNERS})) {
  }
};

TEST_F(AvrRandomStreams, LeaveItAliveAnsweringAndCountingRight) {
  leave_it_alive(500);
}

}  // namespace
}  // namespace bushd::sim::random_streams_test

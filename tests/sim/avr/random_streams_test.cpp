// Random streams for the image for ATmega2560.
#include "sim/random_streams.h"

#include "sim/avr/avr_mcu.h"

namespace bushd::sim::random_streams_test {
namespace {

class AvrRandomStreams : public RandomStreams {
 protected:
  AvrRandomStreams()
      : RandomStreams(200'000'000, [](std::size_t index, Mcu::Driver& driver, EdgeSink* sink) {
          AvrOptions options;
          options.image = AVR_IMAGES "-1000000.elf";
          options.address = kAddress;
          options.unique_id = 0x1122334455667788;
          options.memory_owners = AVR_MEMORY_OWNERS;
          return std::make_unique<AvrMcu>(options, index, driver, sink);
        }) {}
};

TEST_F(AvrRandomStreams, LeaveItAliveAnsweringAndCountingRight) {
  leave_it_alive(500);
}

}  // namespace
}  // namespace bushd::sim::random_streams_test

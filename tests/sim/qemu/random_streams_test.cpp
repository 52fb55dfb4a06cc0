// Random streams for the image for LM3S6965.
#include "sim/random_streams.h"

#include "sim/qemu/qemu_mcu.h"

namespace bushd::sim {
namespace {

class QemuRandomStreams : public RandomStreams {
 protected:
  QemuRandomStreams()
      : RandomStreams(100'000'000,
                      mcu_of<QemuMcu>(QemuOptions{.image = LM3S_IMAGES "-1000000.elf",
                                                  .address = kAddress,
                                                  .unique_id = 0x1122334455667788,
                                                  .memory_owners = LM3S_MEMORY_OWNERS})) {}
};

TEST_F(QemuRandomStreams, LeaveItAliveAnsweringAndCountingRight) {
  leave_it_alive(60);  // a tenth of a second each
}

}  // namespace
}  // namespace bushd::sim

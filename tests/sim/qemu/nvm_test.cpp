// What becomes of what the image for LM3S6965 keeps in its flash when the power goes, and when the
// room for it goes to its end; tests/conformance has the rest.
#include "sim/qemu/qemu_fixture.h"
#include "sim/random.h"

namespace bushd::sim {
namespace {

class QemuNvm : public QemuAlone {
 protected:
  QemuNvm() { master_.patience_ns = 20'000'000; }  // the CRC of a long table takes a while

  void configure(std::uint32_t tick_ns) {
    ASSERT_EQ(master_.acknowledged(kAddress, bushd_configure{tick_ns, BUSHD_FORMAT_FINE, 1000}),
              BUSHD_OK);
  }
  // Another table than that of any other number.
  void upload(std::uint8_t bank, std::uint16_t number, std::size_t codes) {
    const auto first = static_cast<std::uint16_t>(60'000 + number);
    master_.upload_table(kAddress, bank, 10'000, falling_codes(first, codes), 1000);
  }
  std::uint32_t table_crc() {
    const bushd_tables told = master_.tables(kAddress);
    return told.bank[0].valid ? told.bank[0].crc : 0;
  }
};

TEST_F(QemuNvm, APowerCutLeavesTheNewOnesOrThoseOfBefore) {
  Random random(4, 0);
  int fresh = 0;
  int old = 0;
  std::uint32_t kept = 0;
  for (std::uint16_t cut = 0; cut < 8; ++cut) {
    SCOPED_TRACE("cut " + std::to_string(cut));
    ASSERT_NO_FATAL_FAILURE(configure(250'000));
    ASSERT_NO_FATAL_FAILURE(upload(0, cut, 900));
    const std::uint32_t sent = table_crc();
    // It is written 128 ms after the last change, in 12 ms.
    pass(30'000'000 + static_cast<TimeNs>(random.below(80)) * 1'000'000);
    reboot();
    EXPECT_EQ(master_.poll(kAddress).faults, 0);
    const std::uint32_t found = table_crc();
    EXPECT_TRUE(found == sent || found == kept);
    ++(found == sent ? fresh : old);
    kept = found;
  }
  EXPECT_GE(fresh, 2);
  EXPECT_GE(old, 2);
}

// A change of anything is a writing of all: 24 of 96 pages. The fifth begins anew.
TEST_F(QemuNvm, RoomIsFoundAgainAfterAReset) {
  ASSERT_NO_FATAL_FAILURE(configure(640'000));
  for (const std::uint8_t bank : Bytes{0, 1}) ASSERT_NO_FATAL_FAILURE(upload(bank, 0, 6000));
  const std::uint32_t sent = table_crc();
  for (std::uint8_t round = 1; round < 7; ++round) {
    SCOPED_TRACE(int{round});
    bushd_set_inputs inputs{};
    inputs.system_inverted = round;
    ASSERT_EQ(master_.acknowledged(kAddress, inputs), BUSHD_OK);
    pass(600'000'000);
    reboot(700'000'000);
    const bushd_report report = master_.poll(kAddress);
    EXPECT_EQ(report.faults, 0);
    EXPECT_EQ(report.system_inputs, round);
    EXPECT_EQ(table_crc(), sent);
  }
}

}  // namespace
}  // namespace bushd::sim

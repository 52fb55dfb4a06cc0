// The watch over the memory of the image for LM3S6965 sees what must not be, and tells who did it:
// emission_ready, which is called once a tick, does it.
#include <gmock/gmock.h>

#include "sim/qemu/qemu_fixture.h"

namespace bushd::sim {
namespace {

using testing::AllOf;
using testing::HasSubstr;

const QemuMemoryMap& map() {
  static const QemuMemoryMap read(LM3S_IMAGES "-500000.elf", LM3S_MEMORY_OWNERS);
  return read;
}

// Thumb instructions, from a place on.
class Fault {
 public:
  explicit Fault(const std::string& function) : at_(map().function(function)) {}

  Fault& set(unsigned reg, std::uint32_t value) {
    move(0xF240, reg, value & 0xFFFF);  // MOVW
    move(0xF2C0, reg, value >> 16);     // MOVT
    return *this;
  }
  // STR and LDR of r2, at where r3 points.
  Fault& store() { return put(0x601A); }
  Fault& load() { return put(0x681A); }
  Fault& store(std::uint32_t address, std::uint32_t value) {
    return set(3, address).set(2, value).store();
  }
  // BL
  Fault& call(const std::string& function) {
    const std::uint32_t offset = map().function(function) - at_ - 4;
    const std::uint32_t sign = offset >> 24 & 1;
    const std::uint32_t j1 = ~(offset >> 23 ^ sign) & 1;
    const std::uint32_t j2 = ~(offset >> 22 ^ sign) & 1;
    put(0xF000 | sign << 10 | (offset >> 12 & 0x3FF));
    return put(0xD000 | j1 << 13 | j2 << 11 | (offset >> 1 & 0x7FF));
  }
  const std::map<std::uint32_t, std::uint16_t>& pokes() const { return pokes_; }

 private:
  Fault& put(std::uint32_t halfword) {
    pokes_[at_] = static_cast<std::uint16_t>(halfword);
    at_ += 2;
    return *this;
  }
  void move(std::uint32_t code, unsigned reg, std::uint32_t value) {
    put(code | (value >> 11 & 1) << 10 | value >> 12);
    put((value >> 8 & 7) << 12 | reg << 8 | (value & 0xFF));
  }

  std::uint32_t at_;
  std::map<std::uint32_t, std::uint16_t> pokes_;
};

class QemuMemoryWatch : public QemuAlone {
 protected:
  // What is said of it.
  std::string said_of(const Fault& fault) {
    for (const auto& [address, halfword] : fault.pokes()) qemu_->poke(address, halfword);
    try {
      pass(100'000'000);
    } catch (const std::runtime_error& error) {
      return error.what();
    }
    return "nothing";
  }
};

std::uint32_t end_of(const std::string& object) {
  return map().object(object).address + map().object(object).size;
}

TEST(QemuMemoryMap, KnowsCodeObjectsAndParts) {
  EXPECT_EQ(map().thing_at(map().object("mcu.receiver").address + 3), "mcu.receiver.buffer+3");
  EXPECT_EQ(map().object("queue").size, 512u * 16u * 2u);
  EXPECT_THAT(map().place_of(map().main_at()), HasSubstr("main (firmware/ports/lm3s6965/main.c:"));
}

TEST(QemuMemoryMap, HasRoomThatIsNobodysAroundWhatIsFilledFromOutside) {
  for (const char* object : {"received", "reply", "codes", "queue", "mcu"}) {
    for (std::uint32_t i = 0; i < 32; ++i) {
      EXPECT_THAT(map().thing_at(end_of(object) + i), HasSubstr("bytes beyond ")) << object;
      EXPECT_THAT(map().thing_at(map().object(object).address - 1 - i), HasSubstr("bytes beyond "))
          << object;
    }
  }
}

TEST_F(QemuMemoryWatch, SeesWritesToWhatIsOthers) {
  const std::string said =
      said_of(Fault("emission_ready").store(map().object("queue").address + 6, 1));
  EXPECT_THAT(said, HasSubstr("emission_ready (firmware/ports/lm3s6965/emission.c:"));
  EXPECT_THAT(said, HasSubstr("writes what is others': queue+6"));
}

TEST_F(QemuMemoryWatch, SeesThoseThatTheLibraryIsAskedFor) {
  const std::string said = said_of(Fault("emission_ready")
                                       .set(0, map().object("mcu.receiver").address + 2)
                                       .set(1, 0)
                                       .set(2, 1)
                                       .call("memset"));
  EXPECT_THAT(said, HasSubstr("called by emission_ready (firmware/ports/lm3s6965/emission.c:"));
  EXPECT_THAT(said, HasSubstr("writes what is others': mcu.receiver.buffer+2"));
}

TEST_F(QemuMemoryWatch, SeesWritesJustBeyondAnObject) {
  EXPECT_THAT(said_of(Fault("emission_ready").store(end_of("codes"), 1)),
              HasSubstr("writes between objects: "));
}

TEST_F(QemuMemoryWatch, SeesReadsJustBeyondAnObject) {
  EXPECT_THAT(said_of(Fault("emission_ready").set(3, end_of("codes")).load()),
              AllOf(HasSubstr("reads between objects: "), HasSubstr(", 1 bytes beyond codes")));
}

TEST_F(QemuMemoryWatch, SeesWhatIsBelowTheStacksBound) {
  EXPECT_THAT(said_of(Fault("emission_ready").store(map().object("stack").address - 4, 1)),
              HasSubstr("writes between objects: 0x2000fbfc, below the stack's bound"));
}

TEST_F(QemuMemoryWatch, SeesWritesBeyondRam) {
  EXPECT_THAT(said_of(Fault("emission_ready").store(0x20010000, 1)),
              HasSubstr("writes where there is no memory: 0x20010000"));
}

TEST_F(QemuMemoryWatch, SeesWritesToTheProgram) {
  EXPECT_THAT(said_of(Fault("emission_ready").store(0x00001000, 1)),
              HasSubstr("writes where there is no memory: 0x00001000"));
}

TEST_F(QemuMemoryWatch, SeesReadsWhereNothingIs) {
  EXPECT_THAT(said_of(Fault("emission_ready").set(3, 0x00040000).load()),
              HasSubstr("reads where there is no memory: 0x00040000"));
}

// By the flash's controller, its registers FMA and FMC.
TEST_F(QemuMemoryWatch, SeesFlashWrittenThatIsNotForIt) {
  EXPECT_THAT(
      said_of(Fault("emission_ready").store(0x400FD000, 0x00027000).store(0x400FD008, 0xA4420001)),
      HasSubstr("stores into flash that is not for writing: 0x00027000"));
}

TEST_F(QemuMemoryWatch, HasNothingAgainstTheImageAsItIs) {
  EXPECT_EQ(said_of(Fault("emission_ready")), "nothing");
}

}  // namespace
}  // namespace bushd::sim

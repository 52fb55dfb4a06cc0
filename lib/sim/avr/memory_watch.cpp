#include "sim/avr/memory_watch.h"

extern "C" {
#include <sim_avr.h>
#include <sim_io.h>
}

namespace bushd::sim {
namespace {

constexpr std::uint16_t kIoBegin = 0x20;
// In the address space of data.
constexpr std::size_t kEecr = 0x3F;
constexpr std::size_t kEear = 0x41;
constexpr std::uint16_t kEepromEnd = 4096;
constexpr std::uint8_t kEepromAccess = 1 << 0 | 1 << 1;  // EERE, EEPE
constexpr std::size_t kTimsk3 = 0x71;
constexpr std::uint8_t kWaits = 1 << 1;  // OCIE3A
constexpr std::size_t kUcsr0b = 0xC1;
constexpr std::uint8_t kSends = 1 << 5 | 1 << 6;  // UDRIE0, TXCIE0
// What a frame holds that nobody has written: as an address, it is beyond RAM.
constexpr std::uint8_t kNeverWritten = 0xA5;

// LD and LDD: through a pointer. LDS, IN and POP are not.
bool is_pointer_load(std::uint16_t opcode) {
  if ((opcode & 0xD000) == 0x8000) return true;
  if ((opcode & 0xFE00) != 0x9000) return false;
  const int kind = opcode & 0xF;
  return kind != 0 && kind != 0xF;
}

// OUT, to a register of the address space of data.
bool is_out(std::uint16_t opcode, std::uint16_t address) {
  const unsigned a = address - kIoBegin;
  return (opcode & 0xFE0F) == (0xB800 | (a & 0x30) << 5 | (a & 0xF));
}

void on_stack_pointer(avr_t*, avr_io_addr_t address, std::uint8_t value, void* param) {
  static_cast<AvrMemoryWatch*>(param)->stack_pointer(address, value);
}

void on_eeprom_control(avr_t*, avr_io_addr_t, std::uint8_t value, void* param) {
  static_cast<AvrMemoryWatch*>(param)->eeprom_control(value);
}

}  // namespace

// Parts of the image's objects (firmware/ports/atmega2560/main.c).
struct AvrMemoryWatch::Borrowed {
  explicit Borrowed(const AvrMemoryMap& map)
      : buffer(map.object("mcu.receiver.buffer")),
        reply(map.object("mcu.reply")),
        rows_next(map.address_of("mcu.rows.next")),
        rows_count(map.address_of("mcu.rows.count")),
        line(map.unit_named("atmega2560/line.c")),
        decoder(map.unit_named("atmega2560/receive.S")),
        frames(map.unit_named("engine/frame.c")) {}
  const AvrMemoryMap::Object& buffer;
  const AvrMemoryMap::Object& reply;
  std::uint16_t rows_next;
  std::uint16_t rows_count;
  AvrMemoryMap::Unit line;
  AvrMemoryMap::Unit decoder;
  AvrMemoryMap::Unit frames;
};

AvrMemoryWatch::AvrMemoryWatch(avr_t* avr, const AvrChip& chip, const std::string& image,
                               const std::string& owners)
    : avr_(avr),
      chip_(chip),
      map_(map_of<AvrMemoryMap>(image, owners)),
      borrowed_(std::make_unique<Borrowed>(*map_)),
      main_(map_->unit_named("atmega2560/main.c")),
      inputs_(map_->unit_named(std::string(chip.name) + "/inputs.c")) {
  avr_->custom.data = this;
  avr_register_io_write(avr_, kEecr, on_eeprom_control, this);
  avr_register_io_write(avr_, R_SPL, on_stack_pointer, this);
  avr_register_io_write(avr_, R_SPH, on_stack_pointer, this);
}

AvrMemoryWatch::~AvrMemoryWatch() {
  avr_->custom.data = nullptr;
}

void AvrMemoryWatch::violate(const std::string& what) {
  if (violation_) return;
  violation_ = map_->place_of(avr_->pc);
  if (const auto caller = library_caller()) *violation_ += ", called by " + map_->place_of(*caller);
  *violation_ += ": " + what;
  avr_->state = cpu_Crashed;
}

std::uint16_t AvrMemoryWatch::opcode() const {
  return static_cast<std::uint16_t>(avr_->flash[avr_->pc] | avr_->flash[avr_->pc + 1] << 8);
}

std::uint16_t AvrMemoryWatch::stack_pointer() const {
  return static_cast<std::uint16_t>(avr_->data[R_SPL] | avr_->data[R_SPH] << 8);
}

// Library functions write for who has called them: those that do leave the stack alone.
std::optional<std::uint32_t> AvrMemoryWatch::library_caller() const {
  if (map_->unit_at(avr_->pc) != AvrMemoryMap::kNoUnit) return std::nullopt;
  const std::size_t sp = stack_pointer();
  if (sp + chip_.return_bytes > avr_->ramend) return std::nullopt;
  std::uint32_t back = 0;
  for (std::size_t i = 1; i <= chip_.return_bytes; ++i) back = back << 8 | avr_->data[sp + i];
  return 2 * back - 2;
}

AvrMemoryMap::Unit AvrMemoryWatch::writer() const {
  const AvrMemoryMap::Unit unit = map_->unit_at(avr_->pc);
  if (unit != AvrMemoryMap::kNoUnit) return unit;
  return map_->unit_at(library_caller().value_or(avr_->pc));
}

void AvrMemoryWatch::check_stack(std::uint16_t address) {
  const std::uint16_t bound = map_->variables_end() + kReserve;
  if (address < bound) {
    violate("writes to " + hex(address, 4) + ", which is no variable's, nor the stack's above " +
            hex(bound, 4));
  }
}

void AvrMemoryWatch::check_borrowed(AvrMemoryMap::Unit unit, std::uint16_t address) {
  const Borrowed& b = *borrowed_;
  if (address < b.buffer.address || address >= b.buffer.address + b.buffer.size) return;
  const std::uint8_t* const data = avr_->data;
  const bool sends = (data[kTimsk3] & kWaits) != 0 || (data[kUcsr0b] & kSends) != 0;
  if (sends && address >= b.reply.address && address < b.reply.address + b.reply.size) {
    violate("writes to " + hex(address, 4) + " in the reply, which the line is sending");
  }
  if (unit != b.line && unit != b.decoder && unit != b.frames) return;
  if (data[b.rows_next] < data[b.rows_count]) {
    violate("writes to " + hex(address, 4) + " in a frame of which rows are still to be taken");
  }
}

void AvrMemoryWatch::write(std::uint16_t address, std::uint8_t) {
  if (violation_) return;
  if (address < chip_.ram_begin) return;
  if (!in_main_) in_main_ = writer() == main_;
  if (!in_main_) return;
  if (address > avr_->ramend) return violate("writes to " + hex(address, 4) + ", beyond RAM");
  const AvrMemoryMap::Object* const object = map_->object_at(address);
  if (object == nullptr && address > map_->variables_end() && address <= map_->stack_top()) {
    return check_stack(address);
  }
  const AvrMemoryMap::Unit unit = writer();
  if (!map_->may_write(unit, address)) {
    return violate("of " + map_->name_of(unit) + " writes to " + hex(address, 4) + ", in " +
                   (object != nullptr ? object->name : "no object"));
  }
  check_borrowed(unit, address);
}

void AvrMemoryWatch::read(std::uint16_t address) {
  if (violation_ || !in_main_) return;
  if (address > avr_->ramend) return violate("reads " + hex(address, 4) + ", beyond RAM");
  if (address < kIoBegin || address >= chip_.ram_begin) return;
  if (!is_pointer_load(opcode())) return;
  const AvrMemoryMap::Unit unit = writer();
  if (unit == inputs_) return;
  violate("of " + map_->name_of(unit) + " reads the I/O register " + hex(address, 4) +
          " through a pointer");
}

// A function makes its frame by OUT, the high byte first. PUSH and CALL write what they take. A
// reset sets the stack pointer, too, after all registers were cleared, whatever the instruction
// was.
void AvrMemoryWatch::stack_pointer(std::uint16_t address, std::uint8_t value) {
  if (in_main_ && address == R_SPH && is_out(opcode(), R_SPH)) frame_top_ = stack_pointer();
  avr_->data[address] = value;
  if (!in_main_ || address != R_SPL || !is_out(opcode(), R_SPL)) return;
  if (avr_->data[opcode() >> 4 & 0x1Fu] != value) return;
  for (std::uint16_t at = frame_top_; at > stack_pointer() && !violation_; --at) {
    check_stack(at);
    avr_->data[at] = kNeverWritten;
  }
}

void AvrMemoryWatch::eeprom_control(std::uint8_t value) {
  if (violation_ || (value & kEepromAccess) == 0) return;
  const auto address = static_cast<std::uint16_t>(avr_->data[kEear] | avr_->data[kEear + 1] << 8);
  if (address >= kEepromEnd) violate("uses " + hex(address, 4) + " of the EEPROM, beyond its end");
}

}  // namespace bushd::sim

// simavr calls these for every access of its CPU to memory, through the dynamic linker's table: so
// that a program's own come before the library's. They do the same but for its debugger.
extern "C" void avr_core_watch_write(avr_t* avr, std::uint16_t addr, std::uint8_t v) {
  auto* const watch = static_cast<bushd::sim::AvrMemoryWatch*>(avr->custom.data);
  if (watch != nullptr) watch->write(addr, v);
  if (addr > avr->ramend) {
    avr->state = cpu_Crashed;
    return;
  }
  avr->data[addr] = v;
}

extern "C" std::uint8_t avr_core_watch_read(avr_t* avr, std::uint16_t addr) {
  auto* const watch = static_cast<bushd::sim::AvrMemoryWatch*>(avr->custom.data);
  if (watch != nullptr) watch->read(addr);
  if (addr > avr->ramend) {
    avr->state = cpu_Crashed;
    return 0;
  }
  return avr->data[addr];
}

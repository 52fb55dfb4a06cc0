#include "sim/qemu/watch.h"

#include <string.h>

#include "sim/qemu/lockstep.h"

#define FLASH_SIZE 0x40000u
#define RAM 0x20000000u
#define RAM_SIZE 0x10000u
#define REGISTERS 0x40000000u
#define REGISTERS_END 0x40100000u
#define CORE_REGISTERS 0xE0000000u
#define CORE_REGISTERS_END 0xE0100000u

#define NOBODY 0u

static struct {
  void (*violated)(const watch_violation* violation);
  uint32_t from;
  bool on;
  uint32_t caller;                     /* of the library */
  uint8_t flash_units[FLASH_SIZE / 2]; /* by halfword: who has the code there */
  uint8_t ram_units[RAM_SIZE / 2];
  uint64_t writers[RAM_SIZE];
  bool known[RAM_SIZE]; /* an object, or the stack */
} watch;

static uint8_t unit_at(uint32_t pc) {
  if (pc < FLASH_SIZE) return watch.flash_units[pc / 2];
  if (pc - RAM < RAM_SIZE) return watch.ram_units[(pc - RAM) / 2];
  return NOBODY;
}

static bool is_register(uint32_t address) {
  return (address >= REGISTERS && address < REGISTERS_END) ||
         (address >= CORE_REGISTERS && address < CORE_REGISTERS_END);
}

static void violate(uint32_t kind, uint32_t address, uint32_t pc) {
  const watch_violation violation = {kind, address, pc, unit_at(pc) == NOBODY ? watch.caller : 0};
  watch.violated(&violation);
}

static void check_write(uint32_t address, uint32_t size, uint32_t pc) {
  if (is_register(address)) return;
  if (address - RAM >= RAM_SIZE || address - RAM + size > RAM_SIZE) {
    violate(LOCKSTEP_WRITES_NOWHERE, address, pc);
    return;
  }
  uint8_t unit = unit_at(pc);
  if (unit == NOBODY) unit = unit_at(watch.caller);
  for (uint32_t at = address - RAM; at < address - RAM + size; ++at) {
    if (!watch.known[at]) {
      violate(LOCKSTEP_WRITES_GAP, RAM + at, pc);
    } else if ((watch.writers[at] >> unit & 1u) == 0) {
      violate(LOCKSTEP_WRITES_FOREIGN, RAM + at, pc);
    }
  }
}

static void check_read(uint32_t address, uint32_t size, uint32_t pc) {
  if (is_register(address) || (uint64_t)address + size <= FLASH_SIZE) return;
  if (address - RAM >= RAM_SIZE || address - RAM + size > RAM_SIZE) {
    violate(LOCKSTEP_READS_NOWHERE, address, pc);
  } else if (!watch.known[address - RAM] || !watch.known[address - RAM + size - 1]) {
    violate(LOCKSTEP_READS_GAP, address, pc);
  }
}

/* `pc`: of the instruction. */
static void on_access(unsigned cpu, qemu_plugin_meminfo_t info, uint64_t address, void* pc) {
  (void)cpu;
  if (!watch.on) return;
  const uint32_t size = 1u << qemu_plugin_mem_size_shift(info);
  const uint32_t by = (uint32_t)(uintptr_t)pc;
  if (qemu_plugin_mem_is_store(info)) {
    check_write((uint32_t)address, size, by);
  } else {
    check_read((uint32_t)address, size, by);
  }
}

static void on_library_call(unsigned cpu, void* pc) {
  (void)cpu;
  watch.caller = (uint32_t)(uintptr_t)pc;
}

static void on_start(unsigned cpu, void* data) {
  (void)cpu;
  (void)data;
  watch.on = true;
}

/* Where BL and both kinds of B go; 0: another instruction. */
static uint32_t target_of(uint32_t pc, const uint8_t* bytes, size_t size) {
  const uint32_t first = bytes[0] | (uint32_t)bytes[1] << 8;
  if (size == 2) {
    if (first >> 11 != 0x1Cu) return 0;
    const uint32_t offset = (first & 0x7FFu) << 1;
    return pc + 4u + (offset ^ 0x800u) - 0x800u;
  }
  const uint32_t second = bytes[2] | (uint32_t)bytes[3] << 8;
  if (first >> 11 != 0x1Eu || (second & 0x9000u) != 0x9000u) return 0;
  const uint32_t sign = first >> 10 & 1u;
  const uint32_t i1 = ~(second >> 13 ^ sign) & 1u;
  const uint32_t i2 = ~(second >> 11 ^ sign) & 1u;
  const uint32_t offset =
      sign << 24 | i1 << 23 | i2 << 22 | (first & 0x3FFu) << 12 | (second & 0x7FFu) << 1;
  return pc + 4u + (offset ^ 0x1000000u) - 0x1000000u;
}

static void on_translation(qemu_plugin_id_t id, struct qemu_plugin_tb* block) {
  (void)id;
  const size_t count = qemu_plugin_tb_n_insns(block);
  for (size_t i = 0; i < count; ++i) {
    struct qemu_plugin_insn* const instruction = qemu_plugin_tb_get_insn(block, i);
    const uint32_t pc = (uint32_t)qemu_plugin_insn_vaddr(instruction);
    void* const by = (void*)(uintptr_t)pc;
    if (pc == watch.from) {
      qemu_plugin_register_vcpu_insn_exec_cb(instruction, on_start, QEMU_PLUGIN_CB_NO_REGS, NULL);
    }
    uint8_t bytes[4] = {0};
    const size_t size = qemu_plugin_insn_size(instruction);
    cpu_physical_memory_rw(pc, bytes, size, false);
    const uint32_t target = target_of(pc, bytes, size);
    if (target != 0 && unit_at(pc) != NOBODY && unit_at(target) == NOBODY) {
      qemu_plugin_register_vcpu_insn_exec_cb(instruction, on_library_call, QEMU_PLUGIN_CB_NO_REGS,
                                             by);
    }
    qemu_plugin_register_vcpu_mem_cb(instruction, on_access, QEMU_PLUGIN_CB_NO_REGS,
                                     QEMU_PLUGIN_MEM_RW, by);
  }
}

void watch_install(qemu_plugin_id_t id, void (*violated)(const watch_violation* violation)) {
  watch.violated = violated;
  qemu_plugin_register_vcpu_tb_trans_cb(id, on_translation);
}

void watch_code(uint32_t address, uint32_t size, uint8_t unit) {
  for (uint32_t at = address; at < address + size; at += 2) {
    if (at < FLASH_SIZE) watch.flash_units[at / 2] = unit;
    if (at - RAM < RAM_SIZE) watch.ram_units[(at - RAM) / 2] = unit;
  }
}

void watch_object(uint32_t address, uint32_t size, uint64_t writers) {
  for (uint32_t at = address - RAM; at < address - RAM + size && at < RAM_SIZE; ++at) {
    watch.writers[at] = writers;
    watch.known[at] = true;
  }
}

void watch_from(uint32_t address) {
  watch.from = address;
}

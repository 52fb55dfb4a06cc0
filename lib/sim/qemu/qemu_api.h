/* What the machine uses of QEMU, as far as 7.2 (Debian 12) and 10.0 (Debian 13) have it in common.
 * Its headers are not in any package: declared here by hand. Structs that are only handed through
 * are opaque; where QEMU wants memory for one, there is more than it needs. */
#ifndef BUSHD_LIB_SIM_QEMU_QEMU_API_H
#define BUSHD_LIB_SIM_QEMU_QEMU_API_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Plugins. */
typedef uint64_t qemu_plugin_id_t;
typedef struct qemu_info_t qemu_info_t;
typedef uint32_t qemu_plugin_meminfo_t;
struct qemu_plugin_tb;
struct qemu_plugin_insn;
#define QEMU_PLUGIN_CB_NO_REGS 0
#define QEMU_PLUGIN_MEM_RW 3
void qemu_plugin_register_vcpu_tb_trans_cb(qemu_plugin_id_t id,
                                           void (*callback)(qemu_plugin_id_t id,
                                                            struct qemu_plugin_tb* block));
size_t qemu_plugin_tb_n_insns(const struct qemu_plugin_tb* block);
struct qemu_plugin_insn* qemu_plugin_tb_get_insn(const struct qemu_plugin_tb* block, size_t i);
size_t qemu_plugin_insn_size(const struct qemu_plugin_insn* instruction);
uint64_t qemu_plugin_insn_vaddr(const struct qemu_plugin_insn* instruction);
void qemu_plugin_register_vcpu_insn_exec_cb(struct qemu_plugin_insn* instruction,
                                            void (*callback)(unsigned cpu, void* data), int flags,
                                            void* data);
void qemu_plugin_register_vcpu_mem_cb(struct qemu_plugin_insn* instruction,
                                      void (*callback)(unsigned cpu, qemu_plugin_meminfo_t info,
                                                       uint64_t address, void* data),
                                      int flags, int accesses, void* data);
unsigned qemu_plugin_mem_size_shift(qemu_plugin_meminfo_t info);
bool qemu_plugin_mem_is_store(qemu_plugin_meminfo_t info);

/* Objects and devices. */
typedef struct Object Object;
typedef struct DeviceState DeviceState;
typedef struct IRQState* qemu_irq;
const char* object_get_typename(const Object* object);
qemu_irq qemu_allocate_irq(void (*handler)(void* opaque, int n, int level), void* opaque, int n);
void qemu_set_irq(qemu_irq irq, int level);
qemu_irq qdev_get_gpio_in(DeviceState* device, int n);
void qdev_connect_gpio_out(DeviceState* device, int n, qemu_irq pin);

typedef struct Notifier {
  void (*notify)(struct Notifier* notifier, void* data);
  void* node[2];
} Notifier;
void qemu_add_machine_init_done_notifier(Notifier* notifier);

/* Time. */
#define QEMU_CLOCK_VIRTUAL 1
typedef struct QEMUTimer {
  uint64_t space[16];
} QEMUTimer;
int64_t qemu_clock_get_ns(int clock);
void timer_init_full(QEMUTimer* timer, void* group, int clock, int scale, int attributes,
                     void (*callback)(void* opaque), void* opaque);
void timer_mod(QEMUTimer* timer, int64_t expire_time);

/* Character devices. */
typedef struct Chardev Chardev;
Chardev* qemu_chr_find(const char* name);
int qemu_chr_be_can_write(Chardev* chardev);
void qemu_chr_be_write(Chardev* chardev, const uint8_t* bytes, int size);

/* Memory. */
typedef uint64_t hwaddr;
typedef struct AddressSpace AddressSpace;
typedef struct MemTxAttrs {
  uint64_t bits; /* 7.2 takes the lower half */
} MemTxAttrs;
#define NO_ATTRIBUTES ((MemTxAttrs){0})
#define MO_32 2
#define DEVICE_LITTLE_ENDIAN 2
typedef struct MemoryRegion {
  uint64_t space[128];
} MemoryRegion;
typedef struct MemoryRegionOps {
  uint64_t (*read)(void* opaque, hwaddr address, unsigned size);
  void (*write)(void* opaque, hwaddr address, uint64_t data, unsigned size);
  void* with_attributes[2];
  int endianness;
  struct {
    unsigned min_access_size;
    unsigned max_access_size;
    bool unaligned;
    void* accepts;
  } valid;
  struct {
    unsigned min_access_size;
    unsigned max_access_size;
    bool unaligned;
  } impl;
} MemoryRegionOps;
typedef struct MemoryRegionSection {
  uint64_t size[2];
  MemoryRegion* region;
  uint64_t space[13];
} MemoryRegionSection;
extern AddressSpace address_space_memory;
MemoryRegion* get_system_memory(void);
MemoryRegionSection memory_region_find(MemoryRegion* region, hwaddr address, uint64_t size);
Object* memory_region_owner(MemoryRegion* region);
void memory_region_init_io(MemoryRegion* region, Object* owner, const MemoryRegionOps* ops,
                           void* opaque, const char* name, uint64_t size);
void memory_region_add_subregion_overlap(MemoryRegion* region, hwaddr offset, MemoryRegion* sub,
                                         int priority);
uint32_t memory_region_dispatch_read(MemoryRegion* region, hwaddr address, uint64_t* data, int op,
                                     MemTxAttrs attributes);
uint32_t memory_region_dispatch_write(MemoryRegion* region, hwaddr address, uint64_t data, int op,
                                      MemTxAttrs attributes);
void cpu_physical_memory_rw(hwaddr address, void* bytes, hwaddr size, bool write);
uint32_t address_space_write_rom(AddressSpace* space, hwaddr address, MemTxAttrs attributes,
                                 const void* bytes, hwaddr size);

#endif

/* Pins, and the shift registers behind them: 74HC595 for directions, 74HC165 for inputs. */
#include "sim/qemu/machine.h"

#define GPIO_A 0x40004000u
#define GPIO_B 0x40005000u
#define GPIO_C 0x40006000u
#define GPIO_D 0x40007000u
#define GPIO_E 0x40024000u
#define GPIO_F 0x40025000u

#define SYSTEM_INPUTS 4
static qemu_irq system_input[SYSTEM_INPUTS];
static uint32_t system_levels;

static struct {
  qemu_irq data; /* to the CPU */
  uint32_t inputs;
  uint32_t loaded;
  bool load;
  uint32_t out;
  bool out_data;
  bool stuck;
} shifter;

void pins_show_system_inputs(void) {
  for (int i = 0; i < SYSTEM_INPUTS; ++i) qemu_set_irq(system_input[i], system_levels >> i & 1u);
}

void pins_set_inputs(uint32_t motors, uint32_t system) {
  shifter.inputs = motors;
  system_levels = system;
  pins_show_system_inputs();
}

void pins_stick_inputs(void) {
  shifter.stuck = true;
}

static void on_step(void* opaque, int motor, int level) {
  (void)opaque;
  tell(LOCKSTEP_STEP, (uint32_t)level, (uint32_t)motor);
}

static void on_line(void* opaque, int kind, int level) {
  (void)opaque;
  tell((uint32_t)kind, (uint32_t)level, 0);
}

static void on_driver_enable(void* opaque, int n, int level) {
  (void)opaque;
  (void)n;
  tell(LOCKSTEP_DRIVER_ENABLE, (uint32_t)level, uart_busy());
}

/* Of the 165 that comes last: motor 15. */
static void show_input(void) {
  qemu_set_irq(shifter.data, shifter.stuck || (shifter.loaded & 0x8000u) != 0);
}

static void on_shift_clock(void* opaque, int n, int level) {
  (void)opaque;
  (void)n;
  if (!level) return;
  shifter.out = (shifter.out << 1 | shifter.out_data) & 0xFFFFu;
  if (!shifter.load) shifter.loaded = shifter.loaded << 1;
  show_input();
}

static void on_direction_data(void* opaque, int n, int level) {
  (void)opaque;
  (void)n;
  shifter.out_data = level != 0;
}

static void on_direction_latch(void* opaque, int n, int level) {
  (void)opaque;
  (void)n;
  if (level) tell(LOCKSTEP_DIRECTIONS, shifter.out, 0);
}

static void on_input_load(void* opaque, int n, int level) {
  (void)opaque;
  (void)n;
  shifter.load = level == 0;
  if (shifter.load) shifter.loaded = shifter.inputs;
  show_input();
}

static DeviceState* gpio(hwaddr at) {
  return (DeviceState*)memory_region_owner(find(at, "pl061_luminary"));
}

static void wire(DeviceState* port, int pin, void (*handler)(void*, int, int), int n) {
  qdev_connect_gpio_out(port, pin, qemu_allocate_irq(handler, NULL, n));
}

void pins_init(void) {
  for (int i = 0; i < SYSTEM_INPUTS; ++i) system_input[i] = qdev_get_gpio_in(gpio(GPIO_A), 4 + i);
  for (int i = 0; i < 8; ++i) {
    wire(gpio(GPIO_B), i, on_step, i);
    wire(gpio(GPIO_D), i, on_step, 8 + i);
  }
  wire(gpio(GPIO_A), 2, on_line, LOCKSTEP_ENABLE);
  wire(gpio(GPIO_F), 0, on_line, LOCKSTEP_COMMON_DIR);
  wire(gpio(GPIO_F), 1, on_line, LOCKSTEP_COMPARE);
  wire(gpio(GPIO_A), 3, on_driver_enable, 0);
  wire(gpio(GPIO_E), 0, on_shift_clock, 0);
  wire(gpio(GPIO_E), 1, on_direction_data, 0);
  wire(gpio(GPIO_E), 2, on_direction_latch, 0);
  wire(gpio(GPIO_E), 3, on_input_load, 0);
  shifter.data = qdev_get_gpio_in(gpio(GPIO_C), 4);
}

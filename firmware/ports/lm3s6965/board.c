#include "firmware/ports/lm3s6965/board.h"

// Main oscillator of 8 MHz, PLL of 200 MHz, by 4.
#define RCC_WITHOUT_PLL 0x07803B80u  // SYSDIV 15, BYPASS, PWRDN, OEN, XTAL 8 MHz
#define RCC_SYSDIV_4 (3u << 23)
#define RCC_USESYSDIV (1u << 22)
#define RCC_BYPASS (1u << 11)
#define RCC_XTAL_8_MHZ (0xEu << 6)
#define RIS_PLL_LOCK (1u << 6)

#define ADC_MEAN_OF_4 2u
#define GPIO_LOCK_KEY 0x1ACCE551u

static void clock_init(void) {
  SYSCTL_RCC = RCC_WITHOUT_PLL;
  SYSCTL_RCC = RCC_SYSDIV_4 | RCC_USESYSDIV | RCC_BYPASS | RCC_XTAL_8_MHZ;
  while ((SYSCTL_RIS & RIS_PLL_LOCK) == 0) {
  }
  SYSCTL_RCC = RCC_SYSDIV_4 | RCC_USESYSDIV | RCC_XTAL_8_MHZ;
  SYSCTL_USECRL = CYCLES_PER_US - 1u;
}

static void port_init(uint32_t port, uint32_t outputs, uint32_t inputs) {
  GPIO_DATA(port, outputs) = 0;
  GPIO_DIR(port) |= outputs;
  GPIO_PUR(port) |= inputs;
  GPIO_DEN(port) |= outputs | inputs;
}

void board_init(void) {
  clock_init();
  SYSCTL_RCGC0 = 1u << 16 | 1u << 3;    // ADC, watchdog
  SYSCTL_RCGC1 = 1u << 0 | 0xFu << 16;  // UART 0, timers 0 to 3
  SYSCTL_RCGC2 = 0x7Fu;                 // all ports
  (void)SYSCTL_RCGC2;                   // the clock of a port comes some cycles later
  // PB7 is TRST of the debugger unless told otherwise.
  GPIO_LOCK(GPIO_B) = GPIO_LOCK_KEY;
  GPIO_CR(GPIO_B) = 0xFFu;
  GPIO_AFSEL(GPIO_B) = 0;
  GPIO_PUR(GPIO_B) = 0;
  port_init(GPIO_E, 0x0Fu, 0);
  port_init(GPIO_C, 0, 1u << 4);
  port_init(GPIO_F, 1u << 1, 0);
  port_init(GPIO_A, 1u << 3, 0xF0u);
  INPUT_LOAD = ALL_PINS;
  // The UART has its own; its receiver's line is pulled up while the transceiver does not drive it.
  GPIO_AFSEL(GPIO_A) = 1u << 0 | 1u << 1;
  GPIO_PUR(GPIO_A) |= 1u << 0;
  GPIO_DEN(GPIO_A) |= 1u << 0 | 1u << 1;
  // Sequencer 3 takes one sample, of input 0, when it is asked to.
  ADC_SAC = ADC_MEAN_OF_4;
  ADC_SSCTL3 = 1u << 2 | 1u << 1;
  ADC_ACTSS = ADC_SEQUENCER_3;
  board_shift_directions(0);
  board_latch_directions();
}

static void drive(uint32_t port, uint32_t outputs) {
  GPIO_DIR(port) |= outputs;
  GPIO_DEN(port) |= outputs;
}

void board_drive(void) {
  drive(GPIO_A, 1u << 2);
  drive(GPIO_B, 0xFFu);
  drive(GPIO_D, 0xFFu);
  drive(GPIO_F, 1u << 0);
}

// Motor 15 first: it comes to stand in the last register.
void board_shift_directions(uint16_t levels) {
  uint32_t bits = levels;
  for (int i = 0; i < 16; ++i) {
    DIR_DATA = (bits & 0x8000u) != 0 ? ALL_PINS : 0;
    SHIFT_CLOCK = ALL_PINS;
    bits <<= 1;
    SHIFT_CLOCK = 0;
  }
}

uint16_t board_read_inputs(void) {
  INPUT_LOAD = 0;
  INPUT_LOAD = ALL_PINS;
  uint32_t levels = 0;
  for (int i = 0; i < 16; ++i) {
    levels = levels << 1 | (INPUT_DATA != 0);
    SHIFT_CLOCK = ALL_PINS;
    SHIFT_CLOCK = 0;
  }
  return (uint16_t)levels;
}

bool board_test_inputs(void) {
  board_read_inputs();
  return INPUT_DATA == 0;
}

uint16_t board_read_current(void) {
  static uint16_t reading;
  if (board_has_current()) reading = (uint16_t)(ADC_SSFIFO3 & 0x3FFu);
  return reading;
}

// The first time that it runs out is an interrupt, which nobody takes; the second a reset.
void watchdog_start(void) {
  WDT_LOAD = CYCLES_PER_US * 60000u;
  WDT_CTL = 1u << 1 | 1u << 0;
}

#include "firmware/ports/lm3s6965/edges.h"

#include "firmware/ports/lm3s6965/board.h"
#include "firmware/ports/lm3s6965/clock.h"
#include "firmware/ports/lm3s6965/interrupts.h"

static volatile bool awaited;
static volatile bool came;
static uint32_t came_at;  // if `came`

static volatile bool switched_off;
static bool closed_after;  // closed to ground
static uint32_t enable_off;

// In memory that a watchdog reset leaves as it is.
#define ENABLE_KEPT 0x5AC3E910u  // plus BUSHD_ENABLED_*
__attribute__((section(".kept"))) static volatile uint32_t enable_kept;

void edges_init(void) {
  GPIO_IS(GPIO_A) = 0;
  GPIO_IBE(GPIO_A) = 0;
  NVIC_ISER0 = 1u << IRQ_GPIO_A;
}

static void expect(uint32_t pin, bool closes) {
  if (closes) {
    GPIO_IEV(GPIO_A) &= ~pin;
  } else {
    GPIO_IEV(GPIO_A) |= pin;
  }
  GPIO_ICR(GPIO_A) = pin;
  GPIO_IM(GPIO_A) |= pin;
}

void trigger_await(bushd_edge edge) {
  interrupts_off();
  GPIO_IM(GPIO_A) &= ~TRIGGER_PIN;
  came = false;
  awaited = edge != BUSHD_EDGE_NONE;
  if (awaited) {
    // Closed to ground is active.
    expect(TRIGGER_PIN, edge == BUSHD_EDGE_RISING);
  }
  interrupts_on();
}

// Once: a contact bounces.
static void trigger_edge(void) {
  const uint32_t now = clock_now();
  GPIO_IM(GPIO_A) &= ~TRIGGER_PIN;
  GPIO_ICR(GPIO_A) = TRIGGER_PIN;
  if (!awaited) return;
  awaited = false;
  came_at = now;
  came = true;
}

bool trigger_came(uint32_t* time) {
  if (!came) return false;
  came = false;
  *time = came_at;
  return true;
}

static void switch_off(void) {
  ENABLE = enable_off;
  GPIO_IM(GPIO_A) &= ~EMERGENCY_PIN;
  GPIO_ICR(GPIO_A) = EMERGENCY_PIN;
  switched_off = true;
  // Should the core hang, it does not come on again when the watchdog bites.
  enable_kept = 0;
}

bool emergency_unwatch(bool on) {
  interrupts_off();
  GPIO_IM(GPIO_A) &= ~EMERGENCY_PIN;
  const bool may = !switched_off || !on;
  if (may) {
    switched_off = false;
  } else {
    enable_kept = 0;
  }
  interrupts_on();
  return may;
}

void emergency_await(bushd_edge edge, bool off_high) {
  interrupts_off();
  enable_off = off_high ? ALL_PINS : 0;
  closed_after = edge == BUSHD_EDGE_RISING;
  if (edge != BUSHD_EDGE_NONE) {
    expect(EMERGENCY_PIN, closed_after);
    // It may have come before.
    const bool closed = GPIO_DATA(GPIO_A, EMERGENCY_PIN) == 0;
    if (closed == closed_after) switch_off();
  }
  interrupts_on();
}

void emergency_keep_enable(uint8_t enabled) {
  enable_kept = enabled != 0 ? ENABLE_KEPT + enabled : 0;
}

uint8_t emergency_kept_enable(void) {
  const uint32_t enabled = enable_kept - ENABLE_KEPT;
  const bool is_level = enabled == BUSHD_ENABLED_HIGH || enabled == BUSHD_ENABLED_LOW;
  return is_level ? (uint8_t)enabled : 0;
}

uint32_t emergency_latched(uint32_t levels) {
  if (!switched_off) return levels;
  return closed_after ? levels & ~EMERGENCY_PIN : levels | EMERGENCY_PIN;
}

void input_edge(void) {
  const uint32_t edges = GPIO_MIS(GPIO_A);
  if ((edges & EMERGENCY_PIN) != 0) switch_off();
  if ((edges & TRIGGER_PIN) != 0) trigger_edge();
}

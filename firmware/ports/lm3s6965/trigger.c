#include "firmware/ports/lm3s6965/trigger.h"

#include "firmware/ports/lm3s6965/board.h"
#include "firmware/ports/lm3s6965/clock.h"
#include "firmware/ports/lm3s6965/interrupts.h"

static volatile bool awaited;
static volatile bool came;
static uint32_t came_at;  // if `came`

void trigger_init(void) {
  GPIO_IS(GPIO_A) = 0;
  GPIO_IBE(GPIO_A) = 0;
  NVIC_ISER0 = 1u << IRQ_GPIO_A;
}

void trigger_await(bushd_edge edge) {
  interrupts_off();
  GPIO_IM(GPIO_A) = 0;
  came = false;
  awaited = edge != BUSHD_EDGE_NONE;
  if (awaited) {
    // Closed to ground is active.
    GPIO_IEV(GPIO_A) = edge == BUSHD_EDGE_RISING ? 0 : TRIGGER_PIN;
    GPIO_ICR(GPIO_A) = TRIGGER_PIN;
    GPIO_IM(GPIO_A) = TRIGGER_PIN;
  }
  interrupts_on();
}

// Once: a contact bounces.
void trigger_edge(void) {
  const uint32_t now = clock_now();
  GPIO_IM(GPIO_A) = 0;
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

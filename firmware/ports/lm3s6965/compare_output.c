#include "firmware/ports/lm3s6965/compare_output.h"

#include "firmware/ports/lm3s6965/board.h"
#include "firmware/ports/lm3s6965/interrupts.h"
#include "firmware/ports/lm3s6965/timer.h"

#define COMPARE_TIMER TIMER(3)
#define SHORTEST_CYCLES 40u

// Used by the interrupts.
static bool rises;
static uint32_t width;  // of the pulse that rises; 0: it falls in another tick

static void wait(uint32_t cycles) {
  timer_start(COMPARE_TIMER, TIMER_ONE_SHOT, cycles > SHORTEST_CYCLES ? cycles : SHORTEST_CYCLES);
}

void compare_init(void) {
  timer_init(COMPARE_TIMER);
  NVIC_ISER1 = 1u << (IRQ_TIMER3A - 32u);
}

void compare_emit(const compare_edges* edges) {
  rises = edges->rises;
  width = edges->rises && edges->falls ? edges->fall - edges->rise : 0;
  wait(edges->rises ? edges->rise : edges->fall);
}

void compare_due(void) {
  timer_stop(COMPARE_TIMER);
  COMPARE_PIN = rises ? ALL_PINS : 0;
  if (rises && width != 0) wait(width);
  rises = false;
}

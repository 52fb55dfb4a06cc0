// What bushd_velocity makes of lines `INTERVALS WANTED`, after one of `CHANGE LEAST`: for each
// interval with a step `INTERVAL STEP`, and at each line's end `= SPEED PERIOD`. For
// velocity_model.py.
#include <inttypes.h>
#include <stdio.h>

#include "engine/velocity.h"

int main(void) {
  bushd_velocity velocity;
  int32_t change = 0;
  int32_t least = 0;
  if (scanf("%" SCNd32 " %" SCNd32, &change, &least) != 2) return 2;
  bushd_velocity_init(&velocity, change, least);
  uint32_t intervals = 0;
  uint64_t at = 0;
  while (scanf("%" SCNu32 " %" SCNd32, &intervals, &velocity.wanted) == 2) {
    for (; intervals > 0; --intervals, ++at) {
      // As who has no use for idle ones; one by one where that is over.
      const uint16_t idle = bushd_velocity_idle(&velocity);
      const uint32_t skipped = idle < intervals - 1u ? idle : intervals - 1u;
      bushd_velocity_skip(&velocity, (uint16_t)skipped);
      intervals -= skipped;
      at += skipped;
      const int step = bushd_velocity_interval(&velocity);
      if (step != 0) printf("%" PRIu64 " %d\n", at, step);
    }
    printf("= %" PRId32 " %u\n", velocity.now, (unsigned)velocity.period);
  }
  return 0;
}

// What the core believes of itself, checked wherever it is simulated. Images have no room for it:
// they are watched from outside (lib/sim/avr/memory_watch.h).
#ifndef BUSHD_FIRMWARE_CORE_ASSERTION_H
#define BUSHD_FIRMWARE_CORE_ASSERTION_H

#ifdef BUSHD_ASSERTIONS
#ifdef __cplusplus
extern "C" {
#endif
// Tells on stderr, and aborts.
void bushd_assertion_failed(const char* condition, const char* file, int line);
#ifdef __cplusplus
}
#endif
#define BUSHD_ASSERT(condition) \
  ((condition) ? (void)0 : bushd_assertion_failed(#condition, __FILE__, __LINE__))
#else
#define BUSHD_ASSERT(condition) ((void)0)
#endif

#endif

// Signed 64-bit division by that of division.S.
#include <stdbool.h>
#include <stdint.h>

uint64_t __udivdi3(uint64_t numerator, uint64_t divisor);
uint64_t __umoddi3(uint64_t numerator, uint64_t divisor);
int64_t __divdi3(int64_t numerator, int64_t divisor);
int64_t __moddi3(int64_t numerator, int64_t divisor);

static uint64_t size_of(int64_t value) {
  return value < 0 ? -(uint64_t)value : (uint64_t)value;
}

int64_t __divdi3(int64_t numerator, int64_t divisor) {
  const bool negative = (numerator < 0) != (divisor < 0);
  const uint64_t quotient = __udivdi3(size_of(numerator), size_of(divisor));
  return (int64_t)(negative ? -quotient : quotient);
}

int64_t __moddi3(int64_t numerator, int64_t divisor) {
  const bool negative = numerator < 0;
  const uint64_t rest = __umoddi3(size_of(numerator), size_of(divisor));
  return (int64_t)(negative ? -rest : rest);
}

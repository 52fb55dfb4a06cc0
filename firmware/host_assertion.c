#include <stdio.h>
#include <stdlib.h>

#include "firmware/core/assertion.h"

void bushd_assertion_failed(const char* condition, const char* file, int line) {
  fprintf(stderr, "%s:%d: assertion failed: %s\n", file, line, condition);
  abort();
}

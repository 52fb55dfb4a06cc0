// The vectors on the build machine; exit code 0 if all hold.
#include <stdio.h>

#include "vectors/check_vectors.h"

static void report(const char* kind, unsigned index) {
  printf("%s vector %u: the engine disagrees (row %u of its CSV file)\n", kind, index, index + 2);
}

int main(void) {
  unsigned checked = 0;
  const unsigned failed = bushd_check_vectors(&checked, report);
  printf("%u vectors, %u failed\n", checked, failed);
  return failed == 0 ? 0 : 1;
}

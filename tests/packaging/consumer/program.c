/* Asks the daemon for one cycle. Without a daemon: says so. */
#include <bushd_esone.h>
#include <stdio.h>

int main(void) {
  int32_t ext = 0, data = 0, q = 0;
  cdreg(&ext, 1, 1, 5, 0);
  cfsa(0, ext, &data, &q);
  puts(bushd_esone_text());
  return 0;
}

/* esone_program STEPS: with the daemon that the client library finds. */
#include <stdio.h>
#include <stdlib.h>

#include "bushd_esone.h"
#include "program.h"

int main(int argc, char** argv) {
  const int line = argc == 2 ? run_program(atoi(argv[1])) : 1;
  if (line != 0) fprintf(stderr, "esone_program: program.c:%d: %s\n", line, bushd_esone_text());
  return line == 0 ? 0 : 1;
}

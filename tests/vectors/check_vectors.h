// Checks the golden vectors with the engine as it is compiled for firmware.
#ifndef BUSHD_TESTS_VECTORS_CHECK_VECTORS_H
#define BUSHD_TESTS_VECTORS_CHECK_VECTORS_H

// Returns the number of vectors that failed; *checked is the number of all. The failed ones are
// named to `report` ("move", 3), which may be NULL. No heap, no I/O, about 1 KiB of stack: may run
// in an MCU.
unsigned bushd_check_vectors(unsigned* checked, void (*report)(const char* kind, unsigned index));

#endif

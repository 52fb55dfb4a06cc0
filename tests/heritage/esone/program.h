/* Programs as a laboratory writes them, in C. Each returns 0, or the line that went wrong. */
#ifndef BUSHD_TESTS_ESONE_PROGRAM_H
#define BUSHD_TESTS_ESONE_PROGRAM_H

#ifdef __cplusplus
extern "C" {
#endif

/* Loads a program into BUSHD-2 at station 5, starts it, waits for LAM and reads back. */
int run_program(int steps);
/* The same by the names that Fortran calls. */
int run_program_as_fortran(int steps);

#ifdef __cplusplus
}
#endif
#endif

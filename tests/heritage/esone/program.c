#include "program.h"

#include <string.h>

#include "bushd_esone.h"

#define CHECK(holds) \
  if (!(holds)) return __LINE__

enum { kCodes = 238, kBytes = 2 + kCodes };

/* What a Fortran compiler makes of CALL CDREG(...). */
void cdreg_(int32_t*, const int32_t*, const int32_t*, const int32_t*, const int32_t*);
void cfsa_(const int32_t*, const int32_t*, int32_t*, int32_t*);
void csubc_(const int32_t*, const int32_t*, int16_t*, int32_t*);
void cdlam_(int32_t*, const int32_t*, const int32_t*, const int32_t*, const int32_t*,
            const int32_t*);
void cclwt_(const int32_t*);
void cclc_(const int32_t*);
void ctstat_(int32_t*);

static void fill(int16_t* bytes, int steps) {
  bytes[0] = (int16_t)(steps % 256);
  bytes[1] = (int16_t)(steps / 256);
  for (int i = 0; i < kCodes; ++i) bytes[2 + i] = (int16_t)(250 - i);
}

int run_program(int steps) {
  int32_t memory, address, control, request;
  CHECK(cdreg(&memory, 1, 1, 5, 0) == 0);
  CHECK(cdreg(&address, 1, 1, 5, 1) == 0);
  CHECK(cdreg(&control, 1, 1, 5, 2) == 0);
  CHECK(cdreg(&request, 1, 1, 5, 3) == 0);
  CHECK(cccz(memory) == 0);
  int16_t bytes[kBytes];
  fill(bytes, steps);
  int32_t data = 0, q = 0;
  CHECK(cfsa(16, address, &data, &q) == 0 && q == 1);
  int32_t cb[4] = {kBytes, -1, 0, 0};
  CHECK(csubc(16, memory, bytes, cb) == 0 && cb[1] == kBytes);
  data = 0x60;
  CHECK(cfsa(16, control, &data, &q) == 0);
  int32_t lam;
  CHECK(cdlam(&lam, 1, 1, 5, 0, NULL) == 0);
  CHECK(cfsa(26, memory, &data, &q) == 1 && q == 0);
  CHECK(cclwt(lam) == 0);
  int32_t raised = 0;
  CHECK(ctlm(lam, &raised) == 0 && raised == 1);
  CHECK(ctgl(memory, &raised) == 0 && raised == 1);
  CHECK(cfsa(0, request, &data, &q) == 0);
  CHECK((data & 0xFF) == 0x10 && (data >> 8) == steps % 4);
  CHECK(cclc(lam) == 0);
  CHECK(ctlm(lam, &raised) == 0 && raised == 0);
  int16_t back[kBytes];
  data = 0;
  CHECK(cfsa(16, address, &data, &q) == 0);
  CHECK(csubc(0, memory, back, cb) == 0 && cb[1] == kBytes);
  CHECK(memcmp(back, bytes, sizeof back) == 0);
  return 0;
}

int run_program_as_fortran(int steps) {
  const int32_t b = 1, c = 1, n = 5, zero = 0, one = 1, two = 2, permit = 26, write = 16;
  int32_t memory, address, control, k;
  cdreg_(&memory, &b, &c, &n, &zero);
  cdreg_(&address, &b, &c, &n, &one);
  cdreg_(&control, &b, &c, &n, &two);
  ctstat_(&k);
  CHECK(k == 0);
  int16_t bytes[kBytes];
  fill(bytes, steps);
  int32_t data = 0, q = 0;
  cfsa_(&write, &address, &data, &q);
  int32_t cb[4] = {kBytes, 0, 0, 0};
  csubc_(&write, &memory, bytes, cb);
  CHECK(cb[1] == kBytes);
  data = 0x60;
  cfsa_(&write, &control, &data, &q);
  const int32_t inta[2] = {0, 0};
  int32_t lam;
  cdlam_(&lam, &b, &c, &n, &zero, inta);
  cfsa_(&permit, &memory, &data, &q);
  cclwt_(&lam);
  ctstat_(&k);
  CHECK(k == 0);
  cclc_(&lam);
  ctstat_(&k);
  CHECK(k == 0);
  return 0;
}

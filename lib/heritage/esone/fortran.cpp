// The subroutines as Fortran calls them: a trailing underscore, every argument by
// reference; a procedure is passed as what it is.
#include "heritage/esone/bushd_esone.h"

extern "C" {

void cdreg_(int32_t* ext, const int32_t* b, const int32_t* c, const int32_t* n, const int32_t* a);
void cdreg_(int32_t* ext, const int32_t* b, const int32_t* c, const int32_t* n, const int32_t* a) {
  cdreg(ext, *b, *c, *n, *a);
}
void cgreg_(const int32_t* ext, int32_t* b, int32_t* c, int32_t* n, int32_t* a);
void cgreg_(const int32_t* ext, int32_t* b, int32_t* c, int32_t* n, int32_t* a) {
  cgreg(*ext, b, c, n, a);
}
void cfsa_(const int32_t* f, const int32_t* ext, int32_t* data, int32_t* q);
void cfsa_(const int32_t* f, const int32_t* ext, int32_t* data, int32_t* q) {
  cfsa(*f, *ext, data, q);
}
void cssa_(const int32_t* f, const int32_t* ext, int16_t* data, int32_t* q);
void cssa_(const int32_t* f, const int32_t* ext, int16_t* data, int32_t* q) {
  cssa(*f, *ext, data, q);
}
void ctstat_(int32_t* k);
void ctstat_(int32_t* k) {
  ctstat(k);
}
void ctstatus_(const int32_t* ext, int32_t* k);
void ctstatus_(const int32_t* ext, int32_t* k) {
  ctstatus(*ext, k);
}
void cccz_(const int32_t* ext);
void cccz_(const int32_t* ext) {
  cccz(*ext);
}
void cccc_(const int32_t* ext);
void cccc_(const int32_t* ext) {
  cccc(*ext);
}
void ccci_(const int32_t* ext, const int32_t* l);
void ccci_(const int32_t* ext, const int32_t* l) {
  ccci(*ext, *l);
}
void ctci_(const int32_t* ext, int32_t* l);
void ctci_(const int32_t* ext, int32_t* l) {
  ctci(*ext, l);
}
void cccd_(const int32_t* ext, const int32_t* l);
void cccd_(const int32_t* ext, const int32_t* l) {
  cccd(*ext, *l);
}
void ctcd_(const int32_t* ext, int32_t* l);
void ctcd_(const int32_t* ext, int32_t* l) {
  ctcd(*ext, l);
}
void ctgl_(const int32_t* ext, int32_t* l);
void ctgl_(const int32_t* ext, int32_t* l) {
  ctgl(*ext, l);
}
void cdlam_(int32_t* lam, const int32_t* b, const int32_t* c, const int32_t* n, const int32_t* m,
            const int32_t* inta);
void cdlam_(int32_t* lam, const int32_t* b, const int32_t* c, const int32_t* n, const int32_t* m,
            const int32_t* inta) {
  cdlam(lam, *b, *c, *n, *m, inta);
}
void cglam_(const int32_t* lam, int32_t* b, int32_t* c, int32_t* n, int32_t* m, int32_t* inta);
void cglam_(const int32_t* lam, int32_t* b, int32_t* c, int32_t* n, int32_t* m, int32_t* inta) {
  cglam(*lam, b, c, n, m, inta);
}
void cclm_(const int32_t* lam, const int32_t* l);
void cclm_(const int32_t* lam, const int32_t* l) {
  cclm(*lam, *l);
}
void cclc_(const int32_t* lam);
void cclc_(const int32_t* lam) {
  cclc(*lam);
}
void ctlm_(const int32_t* lam, int32_t* l);
void ctlm_(const int32_t* lam, int32_t* l) {
  ctlm(*lam, l);
}
void cclwt_(const int32_t* lam);
void cclwt_(const int32_t* lam) {
  cclwt(*lam);
}
void cfga_(const int32_t* fa, const int32_t* exta, int32_t* intc, int32_t* qa, int32_t* cb);
void cfga_(const int32_t* fa, const int32_t* exta, int32_t* intc, int32_t* qa, int32_t* cb) {
  cfga(fa, exta, intc, qa, cb);
}
void cfmad_(const int32_t* f, const int32_t* extb, int32_t* intc, int32_t* cb);
void cfmad_(const int32_t* f, const int32_t* extb, int32_t* intc, int32_t* cb) {
  cfmad(*f, extb, intc, cb);
}
void cfubc_(const int32_t* f, const int32_t* ext, int32_t* intc, int32_t* cb);
void cfubc_(const int32_t* f, const int32_t* ext, int32_t* intc, int32_t* cb) {
  cfubc(*f, *ext, intc, cb);
}
void cfubr_(const int32_t* f, const int32_t* ext, int32_t* intc, int32_t* cb);
void cfubr_(const int32_t* f, const int32_t* ext, int32_t* intc, int32_t* cb) {
  cfubr(*f, *ext, intc, cb);
}
void csga_(const int32_t* fa, const int32_t* exta, int16_t* intc, int32_t* qa, int32_t* cb);
void csga_(const int32_t* fa, const int32_t* exta, int16_t* intc, int32_t* qa, int32_t* cb) {
  csga(fa, exta, intc, qa, cb);
}
void csmad_(const int32_t* f, const int32_t* extb, int16_t* intc, int32_t* cb);
void csmad_(const int32_t* f, const int32_t* extb, int16_t* intc, int32_t* cb) {
  csmad(*f, extb, intc, cb);
}
void csubc_(const int32_t* f, const int32_t* ext, int16_t* intc, int32_t* cb);
void csubc_(const int32_t* f, const int32_t* ext, int16_t* intc, int32_t* cb) {
  csubc(*f, *ext, intc, cb);
}
void csubr_(const int32_t* f, const int32_t* ext, int16_t* intc, int32_t* cb);
void csubr_(const int32_t* f, const int32_t* ext, int16_t* intc, int32_t* cb) {
  csubr(*f, *ext, intc, cb);
}
void ccinit_(const int32_t* b);
void ccinit_(const int32_t* b) {
  ccinit(*b);
}
void cclnk_(const int32_t* lam, void (*procedure)(void));
void cclnk_(const int32_t* lam, void (*procedure)(void)) {
  cclnk(*lam, procedure);
}
void cculk_(const int32_t* lam);
void cculk_(const int32_t* lam) {
  cculk(*lam);
}
void ccrgl_(const int32_t* lam);
void ccrgl_(const int32_t* lam) {
  ccrgl(*lam);
}
void cfubl_(const int32_t* f, const int32_t* ext, int32_t* intc, int32_t* cb);
void cfubl_(const int32_t* f, const int32_t* ext, int32_t* intc, int32_t* cb) {
  cfubl(*f, *ext, intc, cb);
}
void csubl_(const int32_t* f, const int32_t* ext, int16_t* intc, int32_t* cb);
void csubl_(const int32_t* f, const int32_t* ext, int16_t* intc, int32_t* cb) {
  csubl(*f, *ext, intc, cb);
}

}  // extern "C"

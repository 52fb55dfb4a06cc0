// The subroutines as Fortran calls them: a trailing underscore, every argument by
// reference; a procedure is passed as what it is.
#include "heritage/esone/bushd_esone.h"

// Declared first: compilers warn of a function that no header declares.
#define SUBROUTINE(name, parameters, arguments) \
  void name##_ parameters;                      \
  void name##_ parameters {                     \
    name arguments;                             \
  }

extern "C" {

SUBROUTINE(cdreg,
           (int32_t* ext, const int32_t* b, const int32_t* c, const int32_t* n, const int32_t* a),
           (ext, *b, *c, *n, *a))
SUBROUTINE(cgreg, (const int32_t* ext, int32_t* b, int32_t* c, int32_t* n, int32_t* a),
           (*ext, b, c, n, a))
SUBROUTINE(cfsa, (const int32_t* f, const int32_t* ext, int32_t* data, int32_t* q),
           (*f, *ext, data, q))
SUBROUTINE(cssa, (const int32_t* f, const int32_t* ext, int16_t* data, int32_t* q),
           (*f, *ext, data, q))
SUBROUTINE(ctstat, (int32_t* k), (k))
SUBROUTINE(ctstatus, (const int32_t* ext, int32_t* k), (*ext, k))
SUBROUTINE(cccz, (const int32_t* ext), (*ext))
SUBROUTINE(cccc, (const int32_t* ext), (*ext))
SUBROUTINE(ccci, (const int32_t* ext, const int32_t* l), (*ext, *l))
SUBROUTINE(ctci, (const int32_t* ext, int32_t* l), (*ext, l))
SUBROUTINE(cccd, (const int32_t* ext, const int32_t* l), (*ext, *l))
SUBROUTINE(ctcd, (const int32_t* ext, int32_t* l), (*ext, l))
SUBROUTINE(ctgl, (const int32_t* ext, int32_t* l), (*ext, l))
SUBROUTINE(cdlam,
           (int32_t* lam, const int32_t* b, const int32_t* c, const int32_t* n, const int32_t* m,
            const int32_t* inta),
           (lam, *b, *c, *n, *m, inta))
SUBROUTINE(cglam,
           (const int32_t* lam, int32_t* b, int32_t* c, int32_t* n, int32_t* m, int32_t* inta),
           (*lam, b, c, n, m, inta))
SUBROUTINE(cclm, (const int32_t* lam, const int32_t* l), (*lam, *l))
SUBROUTINE(cclc, (const int32_t* lam), (*lam))
SUBROUTINE(ctlm, (const int32_t* lam, int32_t* l), (*lam, l))
SUBROUTINE(cclwt, (const int32_t* lam), (*lam))
SUBROUTINE(cfga, (const int32_t* fa, const int32_t* exta, int32_t* intc, int32_t* qa, int32_t* cb),
           (fa, exta, intc, qa, cb))
SUBROUTINE(cfmad, (const int32_t* f, const int32_t* extb, int32_t* intc, int32_t* cb),
           (*f, extb, intc, cb))
SUBROUTINE(cfubc, (const int32_t* f, const int32_t* ext, int32_t* intc, int32_t* cb),
           (*f, *ext, intc, cb))
SUBROUTINE(cfubr, (const int32_t* f, const int32_t* ext, int32_t* intc, int32_t* cb),
           (*f, *ext, intc, cb))
SUBROUTINE(csga, (const int32_t* fa, const int32_t* exta, int16_t* intc, int32_t* qa, int32_t* cb),
           (fa, exta, intc, qa, cb))
SUBROUTINE(csmad, (const int32_t* f, const int32_t* extb, int16_t* intc, int32_t* cb),
           (*f, extb, intc, cb))
SUBROUTINE(csubc, (const int32_t* f, const int32_t* ext, int16_t* intc, int32_t* cb),
           (*f, *ext, intc, cb))
SUBROUTINE(csubr, (const int32_t* f, const int32_t* ext, int16_t* intc, int32_t* cb),
           (*f, *ext, intc, cb))
SUBROUTINE(ccinit, (const int32_t* b), (*b))
SUBROUTINE(cclnk, (const int32_t* lam, void (*procedure)(void)), (*lam, procedure))
SUBROUTINE(cculk, (const int32_t* lam), (*lam))
SUBROUTINE(ccrgl, (const int32_t* lam), (*lam))
SUBROUTINE(cfubl, (const int32_t* f, const int32_t* ext, int32_t* intc, int32_t* cb),
           (*f, *ext, intc, cb))
SUBROUTINE(csubl, (const int32_t* f, const int32_t* ext, int16_t* intc, int32_t* cb),
           (*f, *ext, intc, cb))

}  // extern "C"

#undef SUBROUTINE

/* CAMAC subroutines of IEEE 758 (ESONE/SR/01) for the crates of bushd, callable from C and Fortran.
 *
 * In C the names are in lower case, what goes in is passed by value, what comes out by pointer, and
 * arrays by pointer; each function returns the status that ctstat() tells too. In Fortran they are
 * subroutines with the same arguments in the same order, all by reference: INTEGER*4 (INTEGER*2 for
 * short data), logicals as INTEGER, procedures as EXTERNAL.
 *
 * Status K = 4 e + 2 (X = 0) + (Q = 0). Q = 0 alone is no error. Without a cycle the low bits
 * are 3. e:
 *
 *     0  done                        7  invalid LAM handle            20  end address before start
 *     1  branch out of range         8  invalid timeout               22  branches of a scan differ
 *     2  crate out of range          9  the daemon does not answer    23  crates of a scan differ
 *     3  station out of range       11  transport failed              24  repeat count below 1
 *     4  subaddress out of range    12  LAM wait timed out            25  no Q in repeat mode
 *     5  function out of range      15  no such crate
 *     6  invalid EXT
 *
 * bushd_esone_text() says in words what went wrong.
 *
 * All branches are the daemon's; the crate is the number of [[crate]] in bushd.toml. Data are 24
 * bits in an int32_t. Logicals: any value but 0 is true, 1 is returned. Threads may call at the
 * same time; each has a status of its own. A call blocks until the daemon has answered; others may
 * call while one waits for a LAM or for Q.
 *
 * cb[0] repeat count, in; cb[1] tally, out; cb[2] LAM handle to wait for before the first action,
 * 0: none; cb[3] its timeout in ms, 0: for ever. Of cfubc and csubc cb[3] may be -1, too: stop on
 * word, the word without Q is the last one and counts; the wait is for ever.
 *
 * BUSHD-1 and BUSHD-2 have no F24 and F26 for LAM: these forbid and permit motion. Enable their
 * requests in the control register, and do not call cclm for them.
 *
 * Left out: CTCOMP, which no implementation at hand has; and what single ones have beyond the
 * standard, for their own hardware: CCGL (sets a mask of the graded request, which crates here do
 * not have), CAOPEN, CCOPEN and CDCHN (open a crate, or choose the channel to it: here the daemon
 * has opened all of them), CCCOFF (takes a crate off line, which none here can be). */
#ifndef BUSHD_ESONE_H
#define BUSHD_ESONE_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Primary. An address that is out of range gives EXT = 0. */
int cdreg(int32_t* ext, int32_t b, int32_t c, int32_t n, int32_t a);
int cgreg(int32_t ext, int32_t* b, int32_t* c, int32_t* n, int32_t* a);
int cfsa(int32_t f, int32_t ext, int32_t* data, int32_t* q);
int cssa(int32_t f, int32_t ext, int16_t* data, int32_t* q);
/* The status of the thread's last call. */
int ctstat(int32_t* k);
/* Not of the standard: the status of the last cycle at this address, of whichever thread, by cfsa,
 * cssa, cfga, or a block that waits for each LAM; 0 before the first. It leaves ctstat as it is. */
int ctstatus(int32_t ext, int32_t* k);
/* Not of the standard: programs call it first. Nothing needs to be initialised. */
int ccinit(int32_t b);

/* Crate: Z, C, I and demand of the crate that EXT is in; ctgl: a station raises L. */
int cccz(int32_t ext);
int cccc(int32_t ext);
int ccci(int32_t ext, int32_t l);
int ctci(int32_t ext, int32_t* l);
int cccd(int32_t ext, int32_t l);
int ctcd(int32_t ext, int32_t* l);
int ctgl(int32_t ext, int32_t* l);

/* LAM by subaddress (m >= 0: F8, F10, F24, F26 there) or by bit -m of group 2. inta: two words that
 * are kept with it. cclwt waits, at most timeout ms if it is not 0 (cclwt_timeout). */
int cdlam(int32_t* lam, int32_t b, int32_t c, int32_t n, int32_t m, const int32_t* inta);
int cglam(int32_t lam, int32_t* b, int32_t* c, int32_t* n, int32_t* m, int32_t* inta);
int cclm(int32_t lam, int32_t l);
int cclc(int32_t lam);
int ctlm(int32_t lam, int32_t* l);
int cclwt(int32_t lam);
int cclwt_timeout(int32_t lam, int32_t timeout_ms);
/* cclnk: `procedure` is called when the LAM is raised, or is already, in a thread of the library
 * that serves one LAM after the other. It is not called again before ccrgl, which it may call
 * itself, after cclc. When cculk returns it does not run, unless it has called cculk itself. */
int cclnk(int32_t lam, void (*procedure)(void));
int cculk(int32_t lam);
int ccrgl(int32_t lam);

/* Multiple actions. cfga: cb[0] single actions, Q of each in qa. cfmad: scan from extb[0] to
 * extb[1]. cfubc: one register until Q = 0. cfubr: one register, each word until Q, at most 1 s.
 * cfubl: one register, a word for each LAM, until Q = 0; the LAM (cb[2]) is cleared after each
 * word, as no access of these modules clears it. */
int cfga(const int32_t* fa, const int32_t* exta, int32_t* intc, int32_t* qa, int32_t* cb);
int cfmad(int32_t f, const int32_t* extb, int32_t* intc, int32_t* cb);
int cfubc(int32_t f, int32_t ext, int32_t* intc, int32_t* cb);
int cfubr(int32_t f, int32_t ext, int32_t* intc, int32_t* cb);
int cfubl(int32_t f, int32_t ext, int32_t* intc, int32_t* cb);
int csga(const int32_t* fa, const int32_t* exta, int16_t* intc, int32_t* qa, int32_t* cb);
int csmad(int32_t f, const int32_t* extb, int16_t* intc, int32_t* cb);
int csubc(int32_t f, int32_t ext, int16_t* intc, int32_t* cb);
int csubr(int32_t f, int32_t ext, int16_t* intc, int32_t* cb);
int csubl(int32_t f, int32_t ext, int16_t* intc, int32_t* cb);

/* Beyond the standard. What went wrong in the thread's last call; "" if nothing did. Valid until
 * its next call. */
const char* bushd_esone_text(void);

#ifdef __cplusplus
}
#endif
#endif

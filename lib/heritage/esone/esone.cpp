// bushd_esone.h: one lock around all calls but while they wait, and a status for each thread.
#include <mutex>
#include <utility>

#include "heritage/esone/bushd_esone.h"
#include "heritage/esone/calls.h"
#include "heritage/esone/links.h"

namespace bushd::esone {
namespace {

std::mutex mutex;

// Who waits lets others call.
class SharedPort final : public Port {
 public:
  void use(Port& port) { port_ = &port; }
  tl::expected<api::CamacResult, Failure> run(int crate, const camac::Block& block) override {
    return port_->run(crate, block);
  }
  std::int64_t now_ms() override { return port_->now_ms(); }
  void pause_ms(std::int64_t length_ms) override {
    Port* const port = port_;
    mutex.unlock();
    port->pause_ms(length_ms);
    mutex.lock();
  }

 private:
  Port* port_ = &client_port();
};

SharedPort& shared_port() {
  static SharedPort port;
  return port;
}

// Made by the first call.
Calls& calls() {
  static Calls all(shared_port());
  return all;
}

Status& last_status() {
  thread_local Status status;
  return status;
}

int told(Status status) {
  last_status() = std::move(status);
  return last_status().k;
}

// C and Fortran programs have no exceptions.
template <class Work>
int call(const Work& work) {
  const std::lock_guard lock(mutex);
  try {
    return told(work(calls()));
  } catch (const std::exception& error) {
    return told(failed(kTransport, error.what()));
  }
}

// A call that returns a logical.
template <class Work>
int call(std::int32_t* logical, const Work& work) {
  bool value = false;
  const int k = call([&](Calls& all) { return work(all, &value); });
  *logical = value ? 1 : 0;
  return k;
}

Links& links() {
  calls();  // is there as long as the links
  static Links all([](std::int32_t lam) {
    std::int32_t raised = 0;
    return ctlm(lam, &raised) == 0 && raised != 0;
  });
  return all;
}

// `work` is told whether the LAM is linked, and returns the same.
template <class Work>
int of_link(std::int32_t lam, const Work& work) {
  int k = call([&](Calls& all) {
    return all.lam(lam) == nullptr ? failed(kBadLam, "LAM is none of cdlam") : Status{};
  });
  if (k == 0 && !work(links())) k = told(failed(kBadLam, "the LAM has no procedure: cclnk"));
  return k;
}

constexpr int kCommonControls = 28;
constexpr int kController = 30;
constexpr int kDisable = 24;
constexpr int kEnable = 26;
constexpr int kTest = 27;

// Q of a control function means nothing.
Status without_q(Status status) {
  if (status.k == 1) status.k = 0;
  return status;
}

int switch_bit(std::int32_t ext, int a, bool on) {
  return call([&](Calls& all) {
    bool q = false;
    return without_q(all.control(ext, kController, a, on ? kEnable : kDisable, &q));
  });
}

int test_bit(std::int32_t ext, int a, std::int32_t* l) {
  return call(l, [&](Calls& all, bool* q) {
    return without_q(all.control(ext, kController, a, kTest, q));
  });
}

int common_control(std::int32_t ext, int a) {
  return call([&](Calls& all) {
    bool q = false;
    return without_q(all.control(ext, kCommonControls, a, kEnable, &q));
  });
}

}  // namespace

void use(Port& port) {
  const std::lock_guard lock(mutex);
  shared_port().use(port);
}

}  // namespace bushd::esone

using namespace bushd::esone;
using bushd::camac::BlockMode;

extern "C" {

int cdreg(int32_t* ext, int32_t b, int32_t c, int32_t n, int32_t a) {
  const Address address{.branch = b, .crate = c, .station = n, .subaddress = a};
  const Code code = check(address);
  *ext = code == kOk ? ext_of(address) : 0;
  return told(code == kOk ? Status{} : failed(code, "a part of the address is out of range"));
}

int cgreg(int32_t ext, int32_t* b, int32_t* c, int32_t* n, int32_t* a) {
  const auto address = address_of(ext);
  if (!address) return told(failed(kBadExt, "EXT is none of cdreg"));
  *b = address->branch;
  *c = address->crate;
  *n = address->station;
  *a = address->subaddress;
  return told({});
}

int cfsa(int32_t f, int32_t ext, int32_t* data, int32_t* q) {
  return call(q, [&](Calls& all, bool* answer) {
    auto word = static_cast<std::uint32_t>(*data);
    Status status = all.cycle(f, ext, &word, answer);
    if (status.k < 4 && f < 8) *data = static_cast<std::int32_t>(word);
    return status;
  });
}

int cssa(int32_t f, int32_t ext, int16_t* data, int32_t* q) {
  return call(q, [&](Calls& all, bool* answer) {
    std::uint32_t word = static_cast<std::uint16_t>(*data);
    Status status = all.cycle(f, ext, &word, answer);
    if (status.k < 4 && f < 8) *data = static_cast<std::int16_t>(word);
    return status;
  });
}

int ctstat(int32_t* k) {
  *k = last_status().k;
  return *k;
}

int ctstatus(int32_t ext, int32_t* k) {
  const std::lock_guard lock(mutex);
  *k = calls().last_of(ext).k;
  return *k;
}

int ccinit(int32_t b) {
  return told(b >= 0 && b <= kLastBranch ? Status{} : failed(kBadBranch, "branches are 0..7"));
}

int cccz(int32_t ext) {
  return common_control(ext, 8);
}
int cccc(int32_t ext) {
  return common_control(ext, 9);
}
int ccci(int32_t ext, int32_t l) {
  return switch_bit(ext, 9, l != 0);
}
int ctci(int32_t ext, int32_t* l) {
  return test_bit(ext, 9, l);
}
int cccd(int32_t ext, int32_t l) {
  return switch_bit(ext, 10, l != 0);
}
int ctcd(int32_t ext, int32_t* l) {
  return test_bit(ext, 10, l);
}
int ctgl(int32_t ext, int32_t* l) {
  return test_bit(ext, 11, l);
}

int cdlam(int32_t* lam, int32_t b, int32_t c, int32_t n, int32_t m, const int32_t* inta) {
  *lam = 0;
  const Lam made{.address = {.branch = b, .crate = c, .station = n},
                 .m = m,
                 .inta = {inta != nullptr ? inta[0] : 0, inta != nullptr ? inta[1] : 0}};
  const Code code = check(made.address);
  if (code != kOk) return told(failed(code, "a part of the address is out of range"));
  if (m < -24 || m > bushd::camac::kLastSubaddress) {
    return told(failed(kBadSubaddress, "M is a subaddress 0..15, or a bit -1..-24"));
  }
  return call([&](Calls& all) {
    *lam = all.add(made);
    return Status{};
  });
}

int cglam(int32_t lam, int32_t* b, int32_t* c, int32_t* n, int32_t* m, int32_t* inta) {
  return call([&](Calls& all) {
    const Lam* found = all.lam(lam);
    if (found == nullptr) return failed(kBadLam, "LAM is none of cdlam");
    *b = found->address.branch;
    *c = found->address.crate;
    *n = found->address.station;
    *m = found->m;
    if (inta != nullptr) inta[0] = found->inta[0], inta[1] = found->inta[1];
    return Status{};
  });
}

int cclnk(int32_t lam, void (*procedure)(void)) {
  return of_link(lam, [&](Links& all) {
    all.link(lam, procedure);
    return true;
  });
}
int cculk(int32_t lam) {
  return of_link(lam, [&](Links& all) { return all.unlink(lam); });
}
int ccrgl(int32_t lam) {
  return of_link(lam, [&](Links& all) { return all.arm(lam); });
}
int cclm(int32_t lam, int32_t l) {
  return call([&](Calls& all) { return all.enable(lam, l != 0); });
}
int cclc(int32_t lam) {
  return call([&](Calls& all) { return all.clear(lam); });
}
int ctlm(int32_t lam, int32_t* l) {
  return call(l, [&](Calls& all, bool* raised) { return all.test(lam, raised); });
}
int cclwt(int32_t lam) {
  return cclwt_timeout(lam, 0);
}
int cclwt_timeout(int32_t lam, int32_t timeout_ms) {
  return call([&](Calls& all) { return all.wait(lam, timeout_ms); });
}

int cfga(const int32_t* fa, const int32_t* exta, int32_t* intc, int32_t* qa, int32_t* cb) {
  return call([&](Calls& all) { return all.actions(fa, exta, Words(intc), qa, cb); });
}
int cfmad(int32_t f, const int32_t* extb, int32_t* intc, int32_t* cb) {
  return call([&](Calls& all) { return all.scan(f, extb, Words(intc), cb); });
}
int cfubc(int32_t f, int32_t ext, int32_t* intc, int32_t* cb) {
  return call([&](Calls& all) { return all.block(BlockMode::kQStop, f, ext, Words(intc), cb); });
}
int cfubr(int32_t f, int32_t ext, int32_t* intc, int32_t* cb) {
  return call([&](Calls& all) { return all.block(BlockMode::kRepeat, f, ext, Words(intc), cb); });
}
int cfubl(int32_t f, int32_t ext, int32_t* intc, int32_t* cb) {
  return call([&](Calls& all) { return all.at_each_lam(f, ext, Words(intc), cb); });
}
int csga(const int32_t* fa, const int32_t* exta, int16_t* intc, int32_t* qa, int32_t* cb) {
  return call([&](Calls& all) { return all.actions(fa, exta, Words(intc), qa, cb); });
}
int csmad(int32_t f, const int32_t* extb, int16_t* intc, int32_t* cb) {
  return call([&](Calls& all) { return all.scan(f, extb, Words(intc), cb); });
}
int csubc(int32_t f, int32_t ext, int16_t* intc, int32_t* cb) {
  return call([&](Calls& all) { return all.block(BlockMode::kQStop, f, ext, Words(intc), cb); });
}
int csubr(int32_t f, int32_t ext, int16_t* intc, int32_t* cb) {
  return call([&](Calls& all) { return all.block(BlockMode::kRepeat, f, ext, Words(intc), cb); });
}
int csubl(int32_t f, int32_t ext, int16_t* intc, int32_t* cb) {
  return call([&](Calls& all) { return all.at_each_lam(f, ext, Words(intc), cb); });
}

const char* bushd_esone_text(void) {
  return last_status().text.c_str();
}

}  // extern "C"

// The subroutines of IEEE 758, against a crate of the test.
#include <gtest/gtest.h>

#include <condition_variable>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "heritage/camac/bench.h"
#include "heritage/camac/block.h"
#include "heritage/esone/bushd_esone.h"
#include "heritage/esone/calls.h"
#include "heritage/esone/program.h"

namespace bushd::esone {
namespace {

// Crate 1, with a BUSHD-2 at station 5 whose motors make a step whenever somebody waits.
class EsoneTest : public ::testing::Test, public Port {
 protected:
  EsoneTest() {
    crate_.insert(5, module_);
    use(*this);
  }
  ~EsoneTest() override { use(client_port()); }

  tl::expected<api::CamacResult, Failure> run(int crate, const camac::Block& block) override {
    const std::lock_guard lock(mutex_);
    ++runs_;
    if (crate != 1) return tl::unexpected<Failure>(Failure{kNoCrate, "there is no crate"});
    const auto result = camac::transfer(crate_, block);
    return api::CamacResult{.block = result, .requests = crate_.requests()};
  }
  std::int64_t now_ms() override {
    const std::lock_guard lock(mutex_);
    return now_ms_;
  }
  void pause_ms(std::int64_t length_ms) override {
    const std::lock_guard lock(mutex_);
    now_ms_ += length_ms;
    module_.answer(1, {});
  }
  static int e(int k) { return k / 4; }
  static std::int32_t ext(int n, int a, int c = 1) {
    std::int32_t made = 0;
    EXPECT_EQ(cdreg(&made, 0, c, n, a), 0);
    return made;
  }

  static std::int32_t lam_of_5() {
    std::int32_t lam = 0;
    EXPECT_EQ(cdlam(&lam, 1, 1, 5, 0, nullptr), 0);
    return lam;
  }
  static std::int32_t read(int a) {
    std::int32_t data = 0;
    std::int32_t q = 0;
    cfsa(0, ext(5, a), &data, &q);
    return data;
  }
  static void clear_lam() {
    std::int32_t data = 0;
    std::int32_t q = 0;
    cfsa(10, ext(5, 0), &data, &q);
  }
  static void write(int a, std::int32_t data) {
    std::int32_t q = 0;
    cfsa(16, ext(5, a), &data, &q);
  }
  // An address overflow, which is enabled.
  static void raise_lam() {
    write(2, 0x10);
    write(1, 1023);
    read(0);
  }

  std::mutex mutex_;
  std::int64_t now_ms_ = 0;
  int runs_ = 0;
  camac::MotorsBench motors_;
  camac::Bushd2 module_{motors_};
  camac::Crate crate_;
};

TEST_F(EsoneTest, ACProgramMovesAMotor) {
  EXPECT_EQ(run_program(7), 0);
  EXPECT_EQ(motors_.moves.size(), 1U);
}

TEST_F(EsoneTest, AFortranProgramDoesToo) {
  EXPECT_EQ(run_program_as_fortran(9), 0);
  EXPECT_EQ(motors_.moves.size(), 1U);
}

TEST_F(EsoneTest, ExtIsPackedAndUnpacked) {
  for (const auto& [b, c, n, a] : {std::array{0, 1, 1, 0}, {7, 62, 31, 15}, {1, 7, 23, 3}}) {
    std::int32_t made = 0;
    ASSERT_EQ(cdreg(&made, b, c, n, a), 0);
    std::int32_t back[4];
    EXPECT_EQ(cgreg(made, &back[0], &back[1], &back[2], &back[3]), 0);
    EXPECT_EQ((std::array{back[0], back[1], back[2], back[3]}), (std::array{b, c, n, a}));
  }
  EXPECT_LT(ext(5, 15), ext(6, 0)) << "in the order of a scan";
  std::int32_t made = 1;
  const auto code = [&](int b, int c, int n, int a) { return e(cdreg(&made, b, c, n, a)); };
  EXPECT_EQ(code(8, 1, 1, 0), kBadBranch);
  EXPECT_EQ(made, 0);
  EXPECT_EQ(code(0, 63, 1, 0), kBadCrate);
  EXPECT_EQ(code(0, 1, 0, 0), kBadStation);
  EXPECT_EQ(code(0, 1, 1, 16), kBadSubaddress);
  std::int32_t back = 0;
  EXPECT_EQ(e(cgreg(0, &back, &back, &back, &back)), kBadExt);
  EXPECT_EQ(e(cgreg(-1, &back, &back, &back, &back)), kBadExt);
  EXPECT_EQ(runs_, 0) << "no cycle is made";
}

TEST_F(EsoneTest, StatusHasXAndQ) {
  std::int32_t data = 77;
  std::int32_t q = 5;
  EXPECT_EQ(cfsa(0, ext(5, 1), &data, &q), 0);
  EXPECT_EQ(data, 0);
  EXPECT_EQ(q, 1);
  data = 77;
  EXPECT_EQ(cfsa(10, ext(5, 0), &data, &q), 1);
  EXPECT_EQ(data, 77) << "a control function leaves it alone";
  EXPECT_EQ(q, 0);
  EXPECT_EQ(cfsa(0, ext(9, 0), &data, &q), 3);
  std::int32_t k = 0;
  EXPECT_EQ(ctstat(&k), 3);
  EXPECT_NE(std::string(bushd_esone_text()), "");
  EXPECT_EQ(e(cfsa(32, ext(5, 0), &data, &q)), kBadFunction);
  EXPECT_EQ(e(cfsa(0, 0, &data, &q)), kBadExt);
  EXPECT_EQ(e(cfsa(0, ext(5, 0, 2), &data, &q)), kNoCrate);
  std::int16_t word = -1;
  EXPECT_EQ(cssa(16, ext(5, 2), &word, &q), 0);
  EXPECT_EQ(cssa(0, ext(5, 2), &word, &q), 0);
  EXPECT_EQ(word, 0xFF);
}

TEST_F(EsoneTest, EachAddressHasItsStatus) {
  std::int32_t data = 0;
  std::int32_t q = 0;
  std::int32_t k = 7;
  EXPECT_EQ(ctstatus(ext(5, 3), &k), 0) << "before the first cycle";
  cfsa(10, ext(5, 0), &data, &q);
  cfsa(0, ext(9, 0), &data, &q);
  cfsa(0, ext(5, 1), &data, &q);
  EXPECT_EQ(ctstatus(ext(5, 0), &k), 1);
  EXPECT_EQ(k, 1);
  EXPECT_EQ(ctstatus(ext(9, 0), &k), 3);
  EXPECT_EQ(ctstatus(ext(5, 1), &k), 0);
  EXPECT_EQ(e(ctstatus(0, &k)), kBadExt);
  EXPECT_EQ(ctstat(&k), 0) << "that of the last call";
}

TEST_F(EsoneTest, CrateControls) {
  std::int32_t l = 5;
  EXPECT_EQ(ccci(ext(5, 0), 2), 0);
  EXPECT_EQ(ctci(ext(5, 0), &l), 0);
  EXPECT_EQ(l, 1);
  EXPECT_EQ(ccci(ext(5, 0), 0), 0);
  EXPECT_EQ(ctci(ext(5, 0), &l), 0);
  EXPECT_EQ(l, 0);
  EXPECT_EQ(cccd(ext(5, 0), 1), 0);
  EXPECT_EQ(ctcd(ext(5, 0), &l), 0);
  EXPECT_EQ(l, 1);
  EXPECT_EQ(ctgl(ext(5, 0), &l), 0);
  EXPECT_EQ(l, 0);
  write(2, 0x21);
  EXPECT_EQ(cccc(ext(5, 0)), 0);
  EXPECT_EQ(read(2), 0x21);
  EXPECT_EQ(cccz(ext(5, 0)), 0);
  EXPECT_EQ(read(2), 0);
}

TEST_F(EsoneTest, LamHandles) {
  const std::int32_t inta[2] = {3, 4};
  std::int32_t lam = 0;
  EXPECT_EQ(cdlam(&lam, 1, 1, 5, 0, inta), 0);
  std::int32_t back[6];
  EXPECT_EQ(cglam(lam, &back[0], &back[1], &back[2], &back[3], &back[4]), 0);
  EXPECT_EQ((std::vector<std::int32_t>(back, back + 6)),
            (std::vector<std::int32_t>{1, 1, 5, 0, 3, 4}));
  EXPECT_EQ(e(cclwt_timeout(lam, 100)), kLamTimeout);
  EXPECT_EQ(now_ms_, 100);
  std::int32_t l = 0;
  for (const std::int32_t bad : {0, -1, lam + 1000}) EXPECT_EQ(e(ctlm(bad, &l)), kBadLam);
  EXPECT_EQ(e(cdlam(&lam, 1, 1, 5, 16, inta)), kBadSubaddress);
  EXPECT_EQ(lam, 0);
  std::int32_t grouped = 0;
  EXPECT_EQ(cdlam(&grouped, 1, 1, 5, -3, nullptr), 0);
  EXPECT_EQ(ctlm(grouped, &l), 3) << "BUSHD-2 has no group 2";
}

TEST_F(EsoneTest, TimeoutsAreNotNegative) {
  EXPECT_EQ(e(cclwt_timeout(lam_of_5(), -1)), kBadTimeout);
  std::int32_t word = 0;
  std::int32_t cb[4] = {1, 0, lam_of_5(), -1};
  EXPECT_EQ(e(cfubr(0, ext(5, 2), &word, cb)), kBadTimeout);
  cb[2] = 0;
  EXPECT_EQ(cfubr(0, ext(5, 2), &word, cb), 0) << "nothing is waited for";
}

TEST_F(EsoneTest, OthersMayCallWhileOneWaits) {
  const std::int32_t lam = lam_of_5();
  std::thread waits([lam] { EXPECT_EQ(cclwt(lam), 0); });
  raise_lam();
  waits.join();
}

// What is called when the LAM is raised.
struct Served {
  std::mutex mutex;
  std::condition_variable changed;
  int times = 0;
  std::int32_t lam = 0;

  void wait_for(int wanted) {
    std::unique_lock lock(mutex);
    changed.wait(lock, [&] { return times == wanted; });
  }
} served;

void count() {
  const std::lock_guard lock(served.mutex);
  ++served.times;
  served.changed.notify_all();
}
void serve() {
  EXPECT_EQ(cclc(served.lam), 0);
  count();
}
void serve_again() {
  EXPECT_EQ(cclc(served.lam), 0);
  EXPECT_EQ(ccrgl(served.lam), 0);
  count();
}
void serve_for_the_last_time() {
  EXPECT_EQ(cclc(served.lam), 0);
  EXPECT_EQ(cculk(served.lam), 0);
  count();
}

TEST_F(EsoneTest, ALinkedProcedureIsCalledOncePerLam) {
  served.times = 0;
  const std::int32_t lam = served.lam = lam_of_5();
  EXPECT_EQ(e(cclnk(lam + 1000, serve)), kBadLam);
  EXPECT_EQ(e(ccrgl(lam)), kBadLam) << "not linked";
  EXPECT_EQ(e(cculk(lam)), kBadLam);
  EXPECT_EQ(cclnk(lam, serve), 0);
  raise_lam();
  served.wait_for(1);
  raise_lam();
  EXPECT_EQ(served.times, 1);
  EXPECT_EQ(ccrgl(lam), 0);
  served.wait_for(2);
  EXPECT_EQ(cclnk(lam, serve_again), 0) << "takes the place of the other";
  for (int times = 3; times < 6; ++times) {
    raise_lam();
    served.wait_for(times);
  }
  EXPECT_EQ(cculk(lam), 0);
  raise_lam();
  EXPECT_EQ(cclnk(lam, serve_for_the_last_time), 0) << "it is raised already";
  served.wait_for(6);
  EXPECT_EQ(e(cculk(lam)), kBadLam);
  EXPECT_EQ(served.times, 6);
}

TEST_F(EsoneTest, AWordForEachLam) {
  const std::int32_t lam = lam_of_5();
  raise_lam();
  std::int32_t words[3] = {-1, -1, -1};
  std::int32_t cb[4] = {3, -1, lam, 100};
  EXPECT_EQ(e(cfubl(0, ext(5, 1), words, cb)), kLamTimeout) << "for the second";
  EXPECT_EQ(cb[1], 1);
  EXPECT_EQ((std::vector<std::int32_t>(words, words + 3)), (std::vector<std::int32_t>{0, -1, -1}));
  raise_lam();
  EXPECT_EQ(cfubl(0, ext(5, 0), words, cb), 1) << "the memory has no Q while a LAM is raised";
  EXPECT_EQ(cb[1], 0);
  std::int32_t l = 0;
  EXPECT_EQ(ctlm(lam, &l), 0);
  EXPECT_EQ(l, 1) << "and then it stays";
  std::int16_t word = 5;
  cb[0] = 1;
  EXPECT_EQ(csubl(16, ext(5, 1), &word, cb), 0);
  EXPECT_EQ(cb[1], 1);
  cb[2] = 0;
  EXPECT_EQ(e(cfubl(0, ext(5, 1), words, cb)), kBadLam);
  cb[0] = 0;
  EXPECT_EQ(e(cfubl(0, ext(5, 1), words, cb)), kBadCount);
}

TEST_F(EsoneTest, StopOnWordTakesTheWordWithoutQ) {
  write(2, 0x10);  // address overflow ends a block
  write(1, 1022);
  std::int32_t words[5] = {7, 8, 9, 10, 11};
  std::int32_t cb[4] = {5, -1, 0, Calls::kStopOnWord};
  EXPECT_EQ(cfubc(16, ext(5, 0), words, cb), 1);
  EXPECT_EQ(cb[1], 3) << "after the overflow one more is written";
  clear_lam();
  write(1, 1022);
  std::int32_t back[5] = {-1, -1, -1, -1, -1};
  EXPECT_EQ(cfubc(0, ext(5, 0), back, cb), 1);
  EXPECT_EQ(cb[1], 3);
  EXPECT_EQ((std::vector<std::int32_t>(back, back + 5)),
            (std::vector<std::int32_t>{7, 8, 9, -1, -1}));
  EXPECT_EQ(cfubc(0, ext(9, 0), back, cb), 3);
  EXPECT_EQ(cb[1], 0) << "without X there is no word";
}

TEST_F(EsoneTest, BlocksOfOneRegister) {
  std::vector<std::int32_t> words(1500, 7);
  write(2, 0x10);  // address overflow ends a block
  std::int32_t cb[4] = {1500, -1, 0, 0};
  EXPECT_EQ(cfubc(16, ext(5, 0), words.data(), cb), 1);
  EXPECT_EQ(cb[1], 1024);
  clear_lam();
  std::vector<std::int32_t> read(1500, -1);
  EXPECT_EQ(cfubc(0, ext(5, 0), read.data(), cb), 1);
  EXPECT_EQ(cb[1], 1023) << "the cycle without Q has written a byte and counted";
  EXPECT_EQ(read[1022], 7);
  EXPECT_EQ(read[1023], -1);
  EXPECT_EQ(cfubr(0, ext(5, 0), read.data(), cb), 4 * kNoQ + 1);
  EXPECT_EQ(cb[1], 0);
  EXPECT_GE(now_ms_, Calls::kRepeatMs);
  cb[0] = 0;
  EXPECT_EQ(e(cfubc(0, ext(5, 0), read.data(), cb)), kBadCount);
  cb[0] = 5000;
  std::vector<std::int32_t> many(5000, -1);
  EXPECT_EQ(cfubc(0, ext(5, 2), many.data(), cb), 0) << "in two requests";
  EXPECT_EQ(cb[1], 5000);
  EXPECT_EQ(many[4999], 0x10);
  EXPECT_EQ(cfubc(0, ext(9, 0), many.data(), cb), 3);
}

TEST_F(EsoneTest, Scan) {
  std::int32_t words[20] = {0};
  const std::int32_t all[2] = {ext(4, 0), ext(6, 15)};
  std::int32_t cb[4] = {20, 0, 0, 0};
  EXPECT_EQ(cfmad(0, all, words, cb), 0);
  EXPECT_EQ(cb[1], 4) << "BUSHD-2 has four registers to read";
  const std::int32_t backwards[2] = {ext(6, 0), ext(5, 0)};
  EXPECT_EQ(e(cfmad(0, backwards, words, cb)), kEndBeforeStart);
  const std::int32_t crates[2] = {ext(5, 0), ext(5, 0, 2)};
  EXPECT_EQ(e(cfmad(0, crates, words, cb)), kSeveralCrates);
  std::int32_t other = 0;
  cdreg(&other, 1, 1, 6, 0);
  const std::int32_t branches[2] = {ext(5, 0), other};
  EXPECT_EQ(e(cfmad(0, branches, words, cb)), kSeveralBranches);
}

TEST_F(EsoneTest, ListOfActions) {
  const std::int32_t functions[4] = {16, 0, 10, 0};
  const std::int32_t exts[4] = {ext(5, 1), ext(5, 1), ext(5, 0), ext(9, 0)};
  std::int32_t words[4] = {300, -1, -1, -1};
  std::int32_t q[4] = {-1, -1, -1, -1};
  std::int32_t cb[4] = {4, 0, 0, 0};
  EXPECT_EQ(cfga(functions, exts, words, q, cb), 3) << "the worst";
  EXPECT_EQ(cb[1], 4);
  EXPECT_EQ((std::vector<std::int32_t>(words, words + 4)),
            (std::vector<std::int32_t>{300, 300, -1, 0}));
  EXPECT_EQ((std::vector<std::int32_t>(q, q + 4)), (std::vector<std::int32_t>{1, 1, 0, 0}));
}

TEST_F(EsoneTest, BranchesAreInitialised) {
  EXPECT_EQ(ccinit(7), 0);
  EXPECT_EQ(e(ccinit(8)), kBadBranch);
}

}  // namespace
}  // namespace bushd::esone

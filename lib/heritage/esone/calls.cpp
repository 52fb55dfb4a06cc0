#include "heritage/esone/calls.h"

#include <algorithm>
#include <utility>

#include "words/camac.h"

namespace bushd::esone {
namespace {

using camac::Block;
using camac::BlockMode;
using camac::Naf;
using camac::Response;

constexpr std::int32_t kValidExt = 0x40000000;
constexpr std::int32_t kExtBits = 0x073F1F0F;
constexpr std::int32_t kLamBase = 0x20000000;
constexpr int kLastCrate = 62;
constexpr int kLastN = 31;
constexpr std::uint32_t kMostWords = 4096;  // of one request
// LAM by bit position of group 2.
constexpr int kRequestsA = 14;
constexpr int kStatusA = 12;
constexpr int kMaskA = 13;

enum Function { kReadGroup2 = 1, kTestLam = 8, kClearLam = 10, kSet2 = 19, kClear2 = 23 };
constexpr int kDisable = 24;
constexpr int kEnable = 26;

Status of(const Response& response) {
  const int low_bits = (response.x ? 0 : 2) + (response.q ? 0 : 1);
  return {.k = low_bits, .text = response.x ? "" : "X = 0: nothing there has this command"};
}

Status of(const Failure& failure) {
  return failed(failure.code, failure.text);
}

bool is_function(int f) {
  return f >= 0 && f <= camac::kLastFunction;
}

Naf naf_of(const Address& address, int f, std::uint32_t data) {
  return {.station = address.station,
          .subaddress = address.subaddress,
          .function = f,
          .data = data & camac::kDataMask};
}

}  // namespace

std::int32_t ext_of(const Address& address) {
  return kValidExt + (address.branch << 24) + (address.crate << 16) + (address.station << 8) +
         address.subaddress;
}

std::optional<Address> address_of(std::int32_t ext) {
  if ((ext & ~kExtBits) != kValidExt) return std::nullopt;
  const Address address{.branch = ext >> 24 & 0x07,
                        .crate = ext >> 16 & 0x3F,
                        .station = ext >> 8 & 0x1F,
                        .subaddress = ext & 0x0F};
  if (check(address) != kOk) return std::nullopt;
  return address;
}

Code check(const Address& address) {
  if (address.branch < 0 || address.branch > kLastBranch) return kBadBranch;
  if (address.crate < 1 || address.crate > kLastCrate) return kBadCrate;
  if (address.station < 1 || address.station > kLastN) return kBadStation;
  if (address.subaddress < 0 || address.subaddress > camac::kLastSubaddress) return kBadSubaddress;
  return kOk;
}

Status failed(Code code, std::string text, unsigned low_bits) {
  return {.k = 4 * code + static_cast<int>(low_bits), .text = std::move(text)};
}

std::uint32_t Words::get(std::size_t i) const {
  return full_ != nullptr ? static_cast<std::uint32_t>(full_[i])
                          : static_cast<std::uint16_t>(short_[i]);
}

void Words::set(std::size_t i, std::uint32_t data) const {
  if (full_ != nullptr) {
    full_[i] = static_cast<std::int32_t>(data);
  } else {
    short_[i] = static_cast<std::int16_t>(data);
  }
}

Status Calls::cycle(int f, std::int32_t ext, std::uint32_t* data, bool* q) {
  Status status = run(f, ext, data, q);
  if (address_of(ext)) last_k_[ext] = status.k;
  return status;
}

Status Calls::last_of(std::int32_t ext) const {
  if (!address_of(ext)) return failed(kBadExt, "EXT is none of cdreg");
  const auto found = last_k_.find(ext);
  return {.k = found == last_k_.end() ? 0 : found->second};
}

Status Calls::run(int f, std::int32_t ext, std::uint32_t* data, bool* q) {
  *q = false;
  const auto address = address_of(ext);
  if (!is_function(f)) return failed(kBadFunction, "functions are 0..31");
  if (!address) return failed(kBadExt, "EXT is none of cdreg");
  const auto result =
      port_->run(address->crate, {.cycles = {naf_of(*address, f, data != nullptr ? *data : 0)}});
  if (!result) return of(result.error());
  const Response& response = result->block.responses.front();
  if (camac::reads(f) && data != nullptr) *data = response.data;
  *q = response.q;
  return of(response);
}

Status Calls::control(std::int32_t ext, int n, int a, int f, bool* q) {
  *q = false;
  auto address = address_of(ext);
  if (!address) return failed(kBadExt, "EXT is none of cdreg");
  address->station = n;
  address->subaddress = a;
  return cycle(f, ext_of(*address), nullptr, q);
}

std::int32_t Calls::add(const Lam& lam) {
  lams_.push_back(lam);
  return kLamBase + static_cast<std::int32_t>(lams_.size()) - 1;
}

const Lam* Calls::lam(std::int32_t handle) const {
  const std::int64_t index = std::int64_t{handle} - kLamBase;
  if (index < 0 || index >= static_cast<std::int64_t>(lams_.size())) return nullptr;
  return &lams_[static_cast<std::size_t>(index)];
}

Status Calls::at(const Lam& lam, int a, int f, std::uint32_t data, Response* response) {
  Address address = lam.address;
  address.subaddress = a;
  const auto result = port_->run(address.crate, {.cycles = {naf_of(address, f, data)}});
  if (!result) return of(result.error());
  *response = result->block.responses.front();
  // Q of a control function is not told: it means nothing here.
  return response->x ? Status{} : of(*response);
}

Status Calls::enable(std::int32_t handle, bool enabled) {
  const Lam* lam = this->lam(handle);
  if (lam == nullptr) return failed(kBadLam, "LAM is none of cdlam");
  Response response;
  if (lam->m >= 0) return at(*lam, lam->m, enabled ? kEnable : kDisable, 0, &response);
  return at(*lam, kMaskA, enabled ? kSet2 : kClear2, 1U << (-lam->m - 1), &response);
}

Status Calls::clear(std::int32_t handle) {
  const Lam* lam = this->lam(handle);
  if (lam == nullptr) return failed(kBadLam, "LAM is none of cdlam");
  Response response;
  if (lam->m >= 0) return at(*lam, lam->m, kClearLam, 0, &response);
  return at(*lam, kStatusA, kClear2, 1U << (-lam->m - 1), &response);
}

Status Calls::test(std::int32_t handle, bool* raised) {
  *raised = false;
  const Lam* lam = this->lam(handle);
  if (lam == nullptr) return failed(kBadLam, "LAM is none of cdlam");
  Response response;
  const Status status = lam->m >= 0 ? at(*lam, lam->m, kTestLam, 0, &response)
                                    : at(*lam, kRequestsA, kReadGroup2, 0, &response);
  *raised = lam->m >= 0 ? response.q : (response.data >> (-lam->m - 1) & 1) != 0;
  return status;
}

Status Calls::wait(std::int32_t handle, std::int32_t timeout_ms) {
  if (timeout_ms < 0) return failed(kBadTimeout, "a timeout is 0, for ever, or some ms");
  const std::int64_t end_ms = port_->now_ms() + timeout_ms;
  while (true) {
    bool raised = false;
    const Status status = test(handle, &raised);
    if (raised || status.k != 0) return status;
    if (timeout_ms > 0 && port_->now_ms() >= end_ms) {
      return failed(kLamTimeout, "no LAM in " + std::to_string(timeout_ms) + " ms");
    }
    port_->pause_ms(kPollMs);
  }
}

Status Calls::begin(std::int32_t* cb, std::int32_t timeout_ms) {
  cb[1] = 0;
  if (cb[0] < 1) return failed(kBadCount, "the repeat count is below 1");
  return cb[2] == 0 ? Status{} : wait(cb[2], timeout_ms);
}

Status Calls::actions(const std::int32_t* fa, const std::int32_t* exta, Words words,
                      std::int32_t* qa, std::int32_t* cb) {
  Status worst = begin(cb, cb[3]);
  if (worst.k != 0) return worst;
  for (std::size_t i = 0; i < static_cast<std::size_t>(cb[0]); ++i) {
    std::uint32_t data = camac::writes(fa[i]) ? words.get(i) : 0;
    bool q = false;
    Status status = cycle(fa[i], exta[i], &data, &q);
    if (status.k >= 4) return status;
    if (camac::reads(fa[i])) words.set(i, data);
    qa[i] = q ? 1 : 0;
    ++cb[1];
    if (status.k > worst.k) worst = std::move(status);
  }
  return worst;
}

Status Calls::block(BlockMode mode, int f, std::int32_t ext, Words words, std::int32_t* cb) {
  const bool stop_on_word = mode == BlockMode::kQStop && cb[3] == kStopOnWord;
  if (Status begun = begin(cb, stop_on_word ? 0 : cb[3]); begun.k != 0) return begun;
  const auto address = address_of(ext);
  if (!is_function(f)) return failed(kBadFunction, "functions are 0..31");
  if (!address) return failed(kBadExt, "EXT is none of cdreg");
  const auto count = static_cast<std::uint32_t>(cb[0]);
  std::uint32_t tally = 0;
  std::int64_t give_up_ms = port_->now_ms() + kRepeatMs;
  while (tally < count) {
    Block block{.mode = mode, .count = std::min(count - tally, kMostWords)};
    for (std::uint32_t i = 0; i < (camac::writes(f) ? block.count : 1); ++i) {
      const std::uint32_t data = camac::writes(f) ? words.get(tally + i) : 0;
      block.cycles.push_back(naf_of(*address, f, data));
    }
    const auto result = port_->run(address->crate, block);
    if (!result) return of(result.error());
    const auto& [responses, moved] = result->block;
    for (std::uint32_t i = 0; camac::reads(f) && i < moved; ++i) {
      words.set(tally + i, responses[i].data);
    }
    tally += moved;
    cb[1] = static_cast<std::int32_t>(tally);
    if (moved == block.count) continue;
    const Response& last = responses.back();
    if (stop_on_word && last.x) {
      if (camac::reads(f)) words.set(tally, last.data);
      ++cb[1];
    }
    if (mode != BlockMode::kRepeat || !last.x) return of(last);
    if (moved > 0) give_up_ms = port_->now_ms() + kRepeatMs;
    if (port_->now_ms() >= give_up_ms) return failed(kNoQ, "no Q in 1 s", 1);
    port_->pause_ms(1);
  }
  return {};
}

Status Calls::at_each_lam(int f, std::int32_t ext, Words words, std::int32_t* cb) {
  cb[1] = 0;
  if (cb[0] < 1) return failed(kBadCount, "the repeat count is below 1");
  while (cb[1] < cb[0]) {
    if (Status waited = wait(cb[2], cb[3]); waited.k != 0) return waited;
    const auto i = static_cast<std::size_t>(cb[1]);
    std::uint32_t data = camac::writes(f) ? words.get(i) : 0;
    bool q = false;
    if (Status status = cycle(f, ext, &data, &q); status.k != 0) return status;
    if (camac::reads(f)) words.set(i, data);
    ++cb[1];
    if (Status cleared = clear(cb[2]); cleared.k != 0) return cleared;
  }
  return {};
}

Status Calls::scan(int f, const std::int32_t* extb, Words words, std::int32_t* cb) {
  if (Status begun = begin(cb, cb[3]); begun.k != 0) return begun;
  const auto first = address_of(extb[0]);
  const auto last = address_of(extb[1]);
  if (!is_function(f)) return failed(kBadFunction, "functions are 0..31");
  if (!first || !last) return failed(kBadExt, "EXT is none of cdreg");
  if (first->branch != last->branch) return failed(kSeveralBranches, "a scan is of one branch");
  if (first->crate != last->crate) return failed(kSeveralCrates, "a scan is of one crate");
  if (extb[1] < extb[0]) return failed(kEndBeforeStart, "the end address is before the start");
  if (last->station > camac::kStations) return failed(kBadStation, "a scan is of stations 1..23");
  Block block{.mode = BlockMode::kScan,
              .count = std::min(static_cast<std::uint32_t>(cb[0]), kMostWords),
              .last_station = last->station,
              .last_subaddress = last->subaddress};
  for (std::uint32_t i = 0; i < (camac::writes(f) ? block.count : 1); ++i) {
    block.cycles.push_back(naf_of(*first, f, camac::writes(f) ? words.get(i) : 0));
  }
  const auto result = port_->run(first->crate, block);
  if (!result) return of(result.error());
  for (std::uint32_t i = 0; camac::reads(f) && i < result->block.tally; ++i) {
    words.set(i, result->block.responses[i].data);
  }
  cb[1] = static_cast<std::int32_t>(result->block.tally);
  return {};
}

}  // namespace bushd::esone

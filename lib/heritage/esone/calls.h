// The subroutines of bushd_esone.h, over a port. One thread at a time.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "heritage/esone/port.h"

namespace bushd::esone {

struct Address {
  int branch = 0;
  int crate = 0;
  int station = 0;
  int subaddress = 0;
};
constexpr int kLastBranch = 7;
// EXT orders as a scan goes; 0 is none.
std::int32_t ext_of(const Address& address);
std::optional<Address> address_of(std::int32_t ext);
Code check(const Address& address);

struct Lam {
  Address address;  // without the subaddress
  int m = 0;        // of bushd_esone.h
  std::int32_t inta[2] = {0, 0};
};

// K of bushd_esone.h, and why.
struct Status {
  std::int32_t k = 0;
  std::string text{};
};
Status failed(Code code, std::string text, unsigned low_bits = 3);

// Words of a block, as the caller has them: 24 or 16 bits.
class Words {
 public:
  explicit Words(std::int32_t* words) : full_(words) {}
  explicit Words(std::int16_t* words) : short_(words) {}
  std::uint32_t get(std::size_t i) const;
  void set(std::size_t i, std::uint32_t data) const;

 private:
  std::int32_t* full_ = nullptr;
  std::int16_t* short_ = nullptr;
};

class Calls {
 public:
  static constexpr std::int64_t kRepeatMs = 1000;  // without any Q
  static constexpr std::int64_t kPollMs = 20;      // of a LAM
  // In cb[3]: a block ends with the word without Q, which is one; no timeout.
  static constexpr std::int32_t kStopOnWord = -1;

  explicit Calls(Port& port) : port_(&port) {}

  // One cycle. `data` may be null for a function that moves none.
  Status cycle(int f, std::int32_t ext, std::uint32_t* data, bool* q);
  // The status of the last cycle at this address; 0 before the first.
  Status last_of(std::int32_t ext) const;
  // A cycle of the controller of the crate that EXT is in.
  Status control(std::int32_t ext, int n, int a, int f, bool* q);

  std::int32_t add(const Lam& lam);
  const Lam* lam(std::int32_t handle) const;
  Status enable(std::int32_t handle, bool enabled);
  Status clear(std::int32_t handle);
  Status test(std::int32_t handle, bool* raised);
  // 0: for ever.
  Status wait(std::int32_t handle, std::int32_t timeout_ms);

  Status actions(const std::int32_t* fa, const std::int32_t* exta, Words words, std::int32_t* qa,
                 std::int32_t* cb);
  // `mode`: kQStop or kRepeat. Of kQStop cb[3] may be kStopOnWord.
  Status block(camac::BlockMode mode, int f, std::int32_t ext, Words words, std::int32_t* cb);
  // One register, a word for each LAM, which is cleared with it.
  Status at_each_lam(int f, std::int32_t ext, Words words, std::int32_t* cb);
  Status scan(int f, const std::int32_t* extb, Words words, std::int32_t* cb);

 private:
  Status begin(std::int32_t* cb, std::int32_t timeout_ms);
  Status run(int f, std::int32_t ext, std::uint32_t* data, bool* q);
  Status at(const Lam& lam, int a, int f, std::uint32_t data, camac::Response* response);

  Port* port_;
  std::vector<Lam> lams_;
  std::map<std::int32_t, std::int32_t> last_k_;  // by EXT
};

}  // namespace bushd::esone

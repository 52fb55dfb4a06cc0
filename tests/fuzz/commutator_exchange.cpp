// The exchange with a commutator board: whatever bytes come at whatever times, each step that is
// asked for ends once, in an answer, a loss or a cancel; and what is sent is what boards
// understand.
//
// Input: F_start, or the converter that the board has, then operations of four bytes, what, which
// and a number of 16 bits.
#include "fuzz/fuzz.h"
#include "heritage/commutator/exchange.h"

namespace bushd::fuzz {
namespace {

using commutator::Exchange;

// What a board makes of the bytes: a header after 0, then codes.
class Listener {
 public:
  void hear(std::span<const std::uint8_t> bytes, unsigned motor, bool left) {
    for (const std::uint8_t byte : bytes) {
      if (byte == 0) {
        selected_ = -1;
      } else if (selected_ < 0) {
        BUSHD_REQUIRE((byte & 0xF0) == 0x80);
        selected_ = byte & 0x0F;
      } else {
        BUSHD_REQUIRE(selected_ == static_cast<int>(motor | (left ? 8u : 0u)));
      }
    }
  }

 private:
  int selected_ = -1;
};

Exchange::Setup setup_of(std::uint8_t byte) {
  if (byte < 200) return {.start_hz = 1u + byte % 100u, .baud = 9600};
  const std::uint32_t max_code = 1u + (byte - 200u) * 254u / 55u;
  return {
      .start_hz = 0, .baud = 9600, .converter = Converter{.max_hz = 10'000, .max_code = max_code}};
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace bushd::fuzz;
  Input input(data, size);
  Exchange exchange(setup_of(input.u8()));
  Listener board;
  std::int64_t now_us = 0;
  unsigned motor = 0;
  bool left = false;
  bool asked = false;
  while (!input.empty()) {
    const unsigned what = input.u8() % 5u;
    const std::uint8_t which = input.u8();
    const std::uint16_t number = input.u16();
    Exchange::Event event;
    if (what == 0 && exchange.free()) {
      BUSHD_REQUIRE(!asked);
      motor = which % 8u;
      left = which >= 128;
      exchange.step(now_us, motor, left, std::uint64_t{number} * 1'000'000);
      asked = true;
    } else if (what == 1) {
      event = exchange.receive(now_us, which);
    } else if (what == 2) {
      now_us += number * 16;
      event = exchange.advance(now_us);
    } else if (what == 3) {
      if (exchange.cancel()) asked = false;
    } else if (what == 4 && number == 0xFFFF) {
      exchange.forget();
      board = {};
      asked = false;
    }
    if (event.answer || event.lost) {
      BUSHD_REQUIRE(asked && !(event.answer && event.lost) && !event.stray);
      asked = false;
    }
    BUSHD_REQUIRE(asked == !exchange.free());
    BUSHD_REQUIRE(asked || exchange.next_wake_us() == INT64_MAX);
    board.hear(exchange.take_bytes(), motor, left);
  }
  return 0;
}

#include "keypad.h"

#include <fmt/core.h>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "descriptor.h"
#include "pty.h"
#include "typed_keys.h"
#include "waiter.h"

namespace bushsim {
namespace {

using bushd::fail;
using bushd::Result;

constexpr bushd::sim::TimeNs kLookNs = 20'000'000;  // after what the other side has written
constexpr std::size_t kShownAtOnce = 256;

// False: there are no more.
Result<bool> take_keys(TypedKeys& typed, Pty& pty) {
  const auto keys = typed.read();
  if (!keys) return fail(keys.error());
  std::vector<std::uint8_t> bytes;
  for (const char key : *keys) {
    if (const auto byte = keypad_byte_of(key)) bytes.push_back(*byte);
  }
  if (const auto written = pty.write(bytes); !written) return fail(written.error());
  return !keys->empty();
}

// True: there was something.
Result<bool> show(Pty& pty) {
  std::array<std::uint8_t, kShownAtOnce> shown;
  const auto size = pty.read(shown);
  if (!size) return fail(size.error());
  for (const std::uint8_t byte : std::span(shown.data(), *size)) {
    const bool plain = byte == '\n' || (byte >= ' ' && byte <= '~');
    if (plain) std::fputc(byte, stdout);
  }
  std::fflush(stdout);
  return *size > 0;
}

}  // namespace

Result<void> run_keypad(const std::string& link) {
  auto pty = Pty::open(link);
  if (!pty) return fail(pty.error());
  const auto waiter = Waiter::create();
  if (!waiter) return fail(waiter.error());
  TypedKeys typed;
  fmt::print("bushsim: ready {}\nkeys: f forward, r reverse, s slower, x stop\n", link);
  std::fflush(stdout);
  while (true) {
    const auto readable = waiter->wait({typed.fd()}, kLookNs);
    if (!readable) return fail(readable.error());
    if (const auto shown = show(*pty); !shown) {
      return fail(shown.error());
    } else if (!*shown) {
      pty->lift_exclusive_use();
    }
    if (waiter->signal()) return {};
    if (*readable == 0) continue;
    const auto more = take_keys(typed, *pty);
    if (!more) return fail(more.error());
    if (!*more) return {};
  }
}

}  // namespace bushsim

// What happens to bytes on their way between a program and a line, in one direction: through an
// adapter, its driver and a noisy cable.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "sim/edge.h"
#include "sim/random.h"

namespace bushd::sim {

enum class Garbling : std::uint8_t {
  kBitError,        // one to three bits of a byte are flipped
  kLostByte,        // one to four bytes in a row are missing
  kRepeatedByte,    // a byte comes twice
  kDelayedByte,     // a gap in the middle: what follows comes later
  kNoise,           // bytes that nobody sent
  kLostFrame,       // a frame is missing
  kTruncatedFrame,  // a frame breaks off; its delimiter is missing too
  kRepeatedFrame,   // a frame comes again, at once or up to 60 ms later
  kDelayedFrame     // all of it comes later
};

class Garbler {
 public:
  // Bytes that come `delay_ns` after the piece before (the first: after the undisturbed time).
  struct Piece {
    TimeNs delay_ns = 0;
    std::vector<std::uint8_t> bytes;
  };

  Garbler(std::uint64_t seed, std::uint32_t stream) : random_(seed, stream) {}

  // Something in the next bytes that pass is to suffer this.
  void inflict(Garbling what) { pending_.push_back(what); }
  bool idle() const { return pending_.empty(); }

  // Bytes of whole frames, as a rule. Times never fall. The result is valid until the next call.
  std::span<const Piece> pass(TimeNs now_ns, std::span<const std::uint8_t> bytes);

 private:
  using Bytes = std::vector<std::uint8_t>;
  static constexpr std::size_t kOldFrames = 8;

  struct OldFrame {
    TimeNs time_ns = 0;
    Bytes bytes;
  };

  void remember(TimeNs now_ns, std::span<const std::uint8_t> bytes);
  void garble(TimeNs now_ns, Garbling what, Bytes& bytes);

  Random random_;
  std::vector<Garbling> pending_;
  std::optional<Garbling> gap_;  // a delay to be put in when all else is done
  std::array<OldFrame, kOldFrames> old_frames_;
  std::size_t oldest_ = 0;
  std::vector<Piece> pieces_;
  Bytes work_;
};

}  // namespace bushd::sim

#include "sim/garbler.h"

#include <algorithm>

namespace bushd::sim {
namespace {

constexpr TimeNs kMinDelayNs = 1'000'000;
constexpr TimeNs kMaxDelayNs = 60'000'000;  // longer than a master waits for an answer
constexpr std::int64_t kMaxNoise = 300;     // longer than any frame

struct Range {
  std::size_t first;
  std::size_t end;
};

// A frame with its delimiter, chosen at random; what has no delimiter counts as one.
Range pick_frame(const std::vector<std::uint8_t>& bytes, Random& random) {
  std::vector<Range> frames;
  std::size_t first = 0;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (bytes[i] != 0) continue;
    if (i > first) frames.push_back({first, i + 1});
    first = i + 1;
  }
  if (first < bytes.size()) frames.push_back({first, bytes.size()});
  if (frames.empty()) return {0, bytes.size()};
  return random.pick(frames);
}

auto at(std::vector<std::uint8_t>& bytes, std::size_t index) {
  return bytes.begin() + static_cast<std::ptrdiff_t>(index);
}

}  // namespace

void Garbler::remember(TimeNs now_ns, std::span<const std::uint8_t> bytes) {
  old_frames_[oldest_].time_ns = now_ns;
  old_frames_[oldest_].bytes.assign(bytes.begin(), bytes.end());
  oldest_ = (oldest_ + 1) % kOldFrames;
}

std::span<const Garbler::Piece> Garbler::pass(TimeNs now_ns, std::span<const std::uint8_t> bytes) {
  pieces_.clear();
  work_.assign(bytes.begin(), bytes.end());
  for (const Garbling what : pending_) {
    if (!work_.empty()) garble(now_ns, what, work_);
  }
  pending_.clear();
  remember(now_ns, work_);
  pieces_.resize(1);
  pieces_[0].bytes = work_;
  if (gap_ && !work_.empty()) {
    const std::size_t first = *gap_ == Garbling::kDelayedFrame
                                  ? pick_frame(work_, random_).first
                                  : static_cast<std::size_t>(random_.below(work_.size()));
    pieces_.push_back({random_.magnitude(kMinDelayNs, kMaxDelayNs), {}});
    pieces_[1].bytes.assign(at(work_, first), work_.end());
    pieces_[0].bytes.resize(first);
  }
  gap_.reset();
  return pieces_;
}

void Garbler::garble(TimeNs now_ns, Garbling what, Bytes& bytes) {
  const std::size_t i = static_cast<std::size_t>(random_.below(bytes.size()));
  const Range frame = pick_frame(bytes, random_);
  switch (what) {
    case Garbling::kBitError:
      for (std::uint64_t n = 1 + random_.below(3); n > 0; --n) {
        bytes[i] = static_cast<std::uint8_t>(bytes[i] ^ (1u << random_.below(8)));
      }
      break;
    case Garbling::kLostByte:
      bytes.erase(at(bytes, i), at(bytes, std::min(bytes.size(), i + 1 + random_.below(4))));
      break;
    case Garbling::kRepeatedByte:
      bytes.insert(at(bytes, i), bytes[i]);
      break;
    case Garbling::kNoise: {
      Bytes noise(static_cast<std::size_t>(random_.magnitude(1, kMaxNoise)));
      for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random_.below(256));
      // Between frames, as a rule: that is where nobody drives the line.
      const std::size_t where = random_.one_in(4) ? i : frame.first;
      bytes.insert(at(bytes, where), noise.begin(), noise.end());
      break;
    }
    case Garbling::kLostFrame:
      bytes.erase(at(bytes, frame.first), at(bytes, frame.end));
      break;
    case Garbling::kTruncatedFrame: {
      const std::size_t left = static_cast<std::size_t>(random_.below(frame.end - frame.first));
      bytes.erase(at(bytes, frame.first + left), at(bytes, frame.end));
      break;
    }
    case Garbling::kRepeatedFrame: {
      Bytes again(at(bytes, frame.first), at(bytes, frame.end));
      if (!random_.one_in(2)) {
        // Nothing on the way keeps bytes for longer than it delays any.
        const OldFrame& old = random_.pick(old_frames_);
        if (now_ns - old.time_ns <= kMaxDelayNs) again = old.bytes;
      }
      bytes.insert(at(bytes, frame.end), again.begin(), again.end());
      break;
    }
    case Garbling::kDelayedByte:
    case Garbling::kDelayedFrame:
      gap_ = what;
      break;
  }
}

}  // namespace bushd::sim

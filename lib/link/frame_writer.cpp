#include "link/frame_writer.h"

#include <algorithm>

#include "engine/frame.h"

namespace bushd::link {

std::int64_t FrameWriter::line_us(std::size_t bytes) const {
  return static_cast<std::int64_t>(bytes) * 10'000'000 / baud_ + 1;
}

std::uint8_t FrameWriter::send(std::int64_t now_us, McuAddress address, std::uint8_t type,
                               std::span<const std::uint8_t> payload) {
  // After silence a delimiter comes first: it ends whatever noise the receivers took for the
  // beginning of a frame.
  if (free_us_ < now_us) bytes_.push_back(0);
  const std::size_t before = bytes_.size();
  bytes_.resize(before + BUSHD_FRAME_MAX_WIRE);
  const std::size_t size = bushd_frame_encode(address.value, type, ++sequence_, payload.data(),
                                              payload.size(), bytes_.data() + before);
  bytes_.resize(before + size);
  free_us_ = std::max(free_us_, now_us) + line_us(size + 1);
  return sequence_;
}

}  // namespace bushd::link

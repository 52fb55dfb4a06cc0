#include "bus/rs485/frame_writer.h"

#include <algorithm>

namespace bushd::link {
namespace {

// Never 0, which stands for no frame.
std::uint32_t fingerprint(std::uint8_t address, std::uint8_t type,
                          std::span<const std::uint8_t> payload) {
  const std::array<std::uint8_t, 2> header = {address, type};
  const std::uint32_t crc = bushd_crc32(BUSHD_CRC32_START, header.data(), header.size());
  return bushd_crc32(crc, payload.data(), payload.size()) | 1;
}

}  // namespace

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
  sent_[sequence_] = fingerprint(address.value, type, payload);
  free_us_ = std::max(free_us_, now_us) + line_us(size + 1);
  return sequence_;
}

bool FrameWriter::has_sent(const bushd_frame& frame) const {
  return sent_[frame.sequence] ==
         fingerprint(frame.address, frame.type, {frame.payload, frame.payload_size});
}

}  // namespace bushd::link

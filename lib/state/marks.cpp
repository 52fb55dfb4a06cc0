#include "state/marks.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <utility>

#include "engine/frame.h"

namespace bushd::state {
namespace {

constexpr const char* kFormat = "bushd moving marks 1";
constexpr std::size_t kNameAt = 5;
constexpr std::size_t kNumberAt = 72;
constexpr std::size_t kSpareSlots = 32;

using Bytes = std::array<std::uint8_t, Marks::kSlotBytes>;

void put(Bytes& bytes, std::size_t at, std::uint64_t value, unsigned count) {
  for (unsigned i = 0; i < count; ++i) {
    bytes[at + i] = static_cast<std::uint8_t>(value >> (8 * i));
  }
}

std::uint64_t get(const Bytes& bytes, std::size_t at, unsigned count) {
  std::uint64_t value = 0;
  for (unsigned i = count; i > 0; --i) value = value << 8 | bytes[at + i - 1];
  return value;
}

std::uint32_t checksum(const Bytes& bytes) {
  return bushd_crc32(0, bytes.data() + 4, bytes.size() - 4);
}

Bytes encode(const std::string& name, std::uint64_t number) {
  Bytes bytes{};
  const std::size_t size = std::min(name.size(), Marks::kMaxName);
  bytes[4] = static_cast<std::uint8_t>(size);
  std::memcpy(bytes.data() + kNameAt, name.data(), size);
  put(bytes, kNumberAt, number, 8);
  put(bytes, 0, checksum(bytes), 4);
  return bytes;
}

std::optional<Mark> decode(const Bytes& bytes) {
  const std::size_t size = bytes[4];
  if (size == 0 || size > Marks::kMaxName || get(bytes, 0, 4) != checksum(bytes)) {
    return std::nullopt;
  }
  return Mark{.motor = {bytes.begin() + kNameAt, bytes.begin() + kNameAt + size},
              .motion = get(bytes, kNumberAt, 8)};
}

Result<Bytes> read_block(File& file, std::size_t block) {
  Bytes bytes{};
  if (auto read = file.read(block * bytes.size(), bytes); !read) return fail(read.error());
  return bytes;
}

// Leaves alone what is so already.
Result<void> put_block(File& file, std::size_t block, const Bytes& wanted) {
  const auto size = file.size();
  if (!size) return fail(size.error());
  const auto found = read_block(file, block);
  if (!found) return fail(found.error());
  if (*found == wanted && (block + 1) * wanted.size() <= *size) return {};
  return file.write(block * wanted.size(), wanted);
}

}  // namespace

Result<Marks::Content> Marks::read(File& file) {
  const auto size = file.size();
  if (!size) return fail(size.error());
  Content content;
  for (std::size_t block = 0; block < *size / kSlotBytes; ++block) {
    const auto bytes = read_block(file, block);
    if (!bytes) return fail(bytes.error());
    const auto slot = decode(*bytes);
    if (block > 0) {
      content.slots.push_back(slot);
    } else if (slot && slot->motor == kFormat) {
      content.id = slot->motion;
    }
  }
  return content;
}

Marks::Marks(std::unique_ptr<File> file, const std::vector<Mark>& slots) : file_(std::move(file)) {
  for (std::size_t i = 0; i < slots.size(); ++i) slot_of_[slots[i].motor] = i;
}

// The header last: until it stands there, the file does not belong to the database.
Result<Marks> Marks::make(std::unique_ptr<File> file, std::uint64_t id,
                          const std::vector<Mark>& slots) {
  const std::size_t room = (slots.size() / kSpareSlots + 1) * kSpareSlots;
  for (std::size_t i = 0; i < room; ++i) {
    const Bytes slot = i < slots.size() ? encode(slots[i].motor, slots[i].motion) : Bytes{};
    if (auto put = put_block(*file, i + 1, slot); !put) return fail(put.error());
  }
  if (auto synced = file->sync(); !synced) return fail(synced.error());
  if (auto put = put_block(*file, 0, encode(kFormat, id)); !put) return fail(put.error());
  if (auto synced = file->sync(); !synced) return fail(synced.error());
  return Marks(std::move(file), slots);
}

Result<void> Marks::write(const std::vector<Mark>& marks) {
  for (const Mark& mark : marks) {
    const auto slot = slot_of_.find(mark.motor);
    if (slot == slot_of_.end()) return fail("there is no moving mark for " + mark.motor);
    const Bytes bytes = encode(mark.motor, mark.motion);
    if (auto put = file_->write((slot->second + 1) * kSlotBytes, bytes); !put) return put;
  }
  return file_->sync();
}

}  // namespace bushd::state

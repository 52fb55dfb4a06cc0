// The file of moving marks: for each motor the number of the last motion that may have begun, in a
// slot of its own that is written in place. The database says which motion was the last to end; if
// that is another one, the motor moved when the power went. So a mark needs no clearing, and a slot
// that is torn, older or newer than the database never makes a motor look at rest.
//
//   header and slots, 128 bytes each, little-endian:
//     0 CRC-32 of the rest   4 length of the name   5 name, filled up with 0   72 number   80 zeros
//
// The header's name is that of the format, and its number ties the file to its database.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/result.h"
#include "state/disk.h"
#include "state/record.h"

namespace bushd::state {

class Marks {
 public:
  static constexpr std::size_t kSlotBytes = 128;
  static constexpr std::size_t kMaxName = 63;

  // What a file holds; nothing where a slot is torn or was never written.
  struct Content {
    std::optional<std::uint64_t> id{};  // nothing: this is no such file, or its header is torn
    std::vector<std::optional<Mark>> slots{};
  };
  static Result<Content> read(File& file);

  // Puts the file into this state, synced; slots that are so already are not touched. Room for some
  // more motors is made at once, so that the disk cannot be too full for them later.
  static Result<Marks> make(std::unique_ptr<File> file, std::uint64_t id,
                            const std::vector<Mark>& slots);

  // These motions may begin when it has returned: one sync, however many they are. Motors that have
  // no slot are an error.
  Result<void> write(const std::vector<Mark>& marks);

 private:
  Marks(std::unique_ptr<File> file, const std::vector<Mark>& slots);

  std::unique_ptr<File> file_;
  std::map<std::string, std::size_t> slot_of_;
};

}  // namespace bushd::state

// The device that stands for the serial adapter: a pty whose slave has a name of the user's choice.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

#include "base/result.h"
#include "descriptor.h"

namespace bushsim {

class Pty {
 public:
  // Makes a pty in raw mode and lets `link` point to its slave. A symlink of that name is replaced
  // at once (never missing in between); anything else of that name is left alone and an error.
  static bushd::Result<Pty> open(const std::string& link);

  Pty(Pty&&) = default;
  Pty& operator=(Pty&&) = delete;
  // Removes the link if it still points here.
  ~Pty();

  int fd() const { return master_.get(); }
  const std::string& link() const { return link_; }

  // What the other side has written, at most `space`; never blocks. Returns the number of bytes.
  bushd::Result<std::size_t> read(std::span<std::uint8_t> space);

  // Hands bytes to the other side; never blocks. Returns how many it took: fewer if nobody reads.
  bushd::Result<std::size_t> write(std::span<const std::uint8_t> bytes);

  // Lets the device be opened again. A program that took it for itself alone (TIOCEXCL, as
  // libserial does) leaves that behind when it closes, because the slave held here keeps the device
  // alive.
  void lift_exclusive_use();

 private:
  Pty(Descriptor master, Descriptor slave, std::string slave_path, std::string link);

  Descriptor master_;
  // Held open: else the master would see a hang-up whenever the other side closes.
  Descriptor slave_;
  std::string slave_path_;
  std::string link_;
};

}  // namespace bushsim

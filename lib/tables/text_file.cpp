#include "tables/text_file.h"

#include <fmt/format.h>

#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <utility>

namespace bushd::tables {
namespace {

tl::unexpected<Error> unreadable(const std::filesystem::path& path, std::string why) {
  return fail(Error{.message = "cannot be read: " + std::move(why), .file = path.string()});
}

}  // namespace

Result<std::string> read_text(const std::filesystem::path& path, const TextLimit& limit) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    return unreadable(path, error ? error.message() : "no such file");
  }
  const bool is_pipe = std::filesystem::is_fifo(status) && limit.pipes_too;
  if (!std::filesystem::is_regular_file(status) && !is_pipe) {
    return unreadable(path, std::filesystem::is_directory(status)
                                ? "it is a folder, not a regular file"
                                : "not a regular file");
  }
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  if (!file) return unreadable(path, std::strerror(errno));
  // In pieces: files are mostly short, and the largest allowed is costly to make room for.
  std::string text;
  std::array<char, 16 * 1024> piece;
  while (file && text.size() <= limit.bytes) {
    file.read(piece.data(), piece.size());
    text.append(piece.data(), static_cast<std::size_t>(file.gcount()));
  }
  if (file.bad()) return unreadable(path, std::strerror(errno));
  if (text.size() > limit.bytes) {
    return unreadable(path, fmt::format("larger than {} bytes, and {}", limit.bytes, limit.told));
  }
  return text;
}

}  // namespace bushd::tables

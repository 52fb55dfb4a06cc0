#include "token_file.h"

#include <cerrno>
#include <cstring>
#include <utility>

#include "tokens/token_file.h"

namespace bushweb {
namespace {

bool is_same(const timespec& a, const timespec& b) {
  return a.tv_sec == b.tv_sec && a.tv_nsec == b.tv_nsec;
}

}  // namespace

// Remembered is only what could be read: rights that are mended make no file look new.
std::string TokenFile::refresh() {
  struct stat status{};
  if (::stat(path_.c_str(), &status) != 0) {
    const int error = errno;
    return forget(error == ENOENT ? "" : path_ + ": " + std::strerror(error));
  }
  const bool same = status.st_ino == seen_.st_ino && is_same(status.st_mtim, seen_.st_mtim) &&
                    is_same(status.st_ctim, seen_.st_ctim);
  if (same) return "";
  auto read = bushd::tokens::read(path_);
  if (!read) return forget(read.error().text());
  seen_ = status;
  wrong_.clear();
  tokens_ = std::move(*read);
  return "";
}

std::string TokenFile::forget(const std::string& why) {
  tokens_.clear();
  seen_ = {};
  return std::exchange(wrong_, why) == why ? "" : why;
}

std::optional<bushd::tokens::Token> TokenFile::find(const std::string& token,
                                                    std::int64_t now_s) const {
  return bushd::tokens::find(tokens_, token, now_s);
}

}  // namespace bushweb

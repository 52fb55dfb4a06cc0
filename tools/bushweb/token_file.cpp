#include "token_file.h"

#include "tokens/token_file.h"

namespace bushweb {

std::string TokenFile::refresh() {
  struct stat status{};
  if (::stat(path_.c_str(), &status) != 0) {
    tokens_.clear();
    inode_ = 0;
    return "";
  }
  const bool same = status.st_ino == inode_ && status.st_mtim.tv_sec == changed_.tv_sec &&
                    status.st_mtim.tv_nsec == changed_.tv_nsec;
  if (same) return "";
  inode_ = status.st_ino;
  changed_ = status.st_mtim;
  tokens_.clear();
  auto read = bushd::tokens::read(path_);
  if (!read) return read.error().text();
  tokens_ = std::move(*read);
  return "";
}

std::optional<bushd::tokens::Token> TokenFile::find(const std::string& token,
                                                    std::int64_t now_s) const {
  return bushd::tokens::find(tokens_, token, now_s);
}

}  // namespace bushweb

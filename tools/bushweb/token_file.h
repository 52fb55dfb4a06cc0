// The tokens that `bushctl web-token` has made, as their file says just now.
#pragma once

#include <sys/stat.h>

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "tokens/token.h"

namespace bushweb {

class TokenFile {
 public:
  explicit TokenFile(std::string path) : path_(std::move(path)) {}

  // Reads it again if it has changed. What is no file of tokens has none in it: the reason is
  // returned once for each change; "": all is well, as where there is no file.
  std::string refresh();
  // Whose token it is, at this time.
  std::optional<bushd::tokens::Token> find(const std::string& token, std::int64_t now_s) const;

 private:
  // There are no tokens; what is to be said.
  std::string forget(const std::string& why);

  std::string path_;
  struct stat seen_{};
  std::string wrong_{};  // what was said last
  std::vector<bushd::tokens::Token> tokens_{};
};

}  // namespace bushweb

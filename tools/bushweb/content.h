// The files of the page, in memory: what is not here cannot be asked for.
#pragma once

#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "base/result.h"

namespace bushweb {

// What is said to a request over HTTP.
struct Answer {
  int status = 200;
  std::string type{};  // of the body; "": there is none
  std::shared_ptr<const std::string> body{};
  std::vector<std::pair<std::string, std::string>> headers{};
};

Answer text_answer(int status, std::string text);
Answer json_answer(int status, std::string json);

class Content {
 public:
  static constexpr std::size_t kMostBytes = 4 * 1024 * 1024;  // of a file

  // All files in a folder, which are to have index.html among them.
  static bushd::Result<Content> load(const std::string& folder);

  // A file, "/" for index.html; compressed where that is there and wanted.
  const Answer* find(std::string_view path, bool takes_gzip) const;

 private:
  std::map<std::string, Answer, std::less<>> files_{};
};

}  // namespace bushweb

#include "content.h"

#include <fmt/format.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <system_error>

namespace bushweb {
namespace {

namespace fs = std::filesystem;

constexpr std::array<std::pair<std::string_view, std::string_view>, 6> kTypes{
    {{".html", "text/html; charset=utf-8"},
     {".js", "text/javascript; charset=utf-8"},
     {".css", "text/css; charset=utf-8"},
     {".svg", "image/svg+xml"},
     {".json", "application/json"},
     {".png", "image/png"}}};

constexpr std::string_view kCompressed = ".gz";

std::string type_of(std::string_view name) {
  for (const auto& [ending, type] : kTypes) {
    if (name.ends_with(ending)) return std::string(type);
  }
  return "application/octet-stream";
}

Answer with_body(int status, std::string_view type, std::string body) {
  return {.status = status,
          .type = std::string(type),
          .body = std::make_shared<const std::string>(std::move(body))};
}

}  // namespace

Answer text_answer(int status, std::string text) {
  return with_body(status, "text/plain; charset=utf-8", std::move(text) + "\n");
}

Answer json_answer(int status, std::string json) {
  return with_body(status, "application/json", std::move(json) + "\n");
}

bushd::Result<Content> Content::load(const std::string& folder) {
  Content content;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (!entry.is_regular_file(error) || entry.file_size(error) > kMostBytes) continue;
    std::ifstream file(entry.path(), std::ios::binary);
    std::string bytes{std::istreambuf_iterator<char>(file), {}};
    std::string name = entry.path().filename().string();
    std::string_view plain = name;
    const bool compressed = plain.ends_with(kCompressed);
    if (compressed) plain.remove_suffix(kCompressed.size());
    Answer answer = with_body(200, type_of(plain), std::move(bytes));
    answer.headers = {{"cache-control", "no-cache"}, {"vary", "accept-encoding"}};
    if (compressed) answer.headers.emplace_back("content-encoding", "gzip");
    content.files_["/" + name] = std::move(answer);
  }
  if (content.files_.contains("/index.html")) return content;
  return bushd::fail(bushd::Error{
      .message = "the page is not there: the package bushd-web has it; in the source tree run "
                 "'tools/setup --web', and start bushd-web with --page build/web",
      .file = folder});
}

const Answer* Content::find(std::string_view path, bool takes_gzip) const {
  const std::string_view name = path == "/" ? "/index.html" : path;
  if (name.ends_with(kCompressed)) return nullptr;
  if (takes_gzip) {
    const auto found = files_.find(std::string(name) + std::string(kCompressed));
    if (found != files_.end()) return &found->second;
  }
  const auto found = files_.find(name);
  return found == files_.end() ? nullptr : &found->second;
}

}  // namespace bushweb

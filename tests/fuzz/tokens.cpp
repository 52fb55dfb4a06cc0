// Any text as a file of tokens, and as a token that somebody types.
#include <set>
#include <string_view>

#include "fuzz/fuzz.h"
#include "tokens/token.h"

namespace bushd::fuzz {
namespace {

void check_file(std::string_view text) {
  const auto read = tokens::parse(text, "tokens");
  if (!read) {
    const Error& error = read.error();
    BUSHD_REQUIRE(error.file == "tokens" && !error.message.empty());
    BUSHD_REQUIRE(error.line > 0 || text.size() > tokens::kMaxFileBytes);
    return;
  }
  BUSHD_REQUIRE(read->size() <= tokens::kMaxTokens);
  std::set<std::string> names;
  std::set<std::string> hashes;
  int line = 0;
  for (const tokens::Token& token : *read) {
    BUSHD_REQUIRE(!token.name.empty() && token.name.size() <= tokens::kMaxNameLength);
    BUSHD_REQUIRE(token.hash.size() == 64 && token.expires_s >= 0 && token.made_s >= 0);
    BUSHD_REQUIRE(names.insert(token.name).second && hashes.insert(token.hash).second);
    BUSHD_REQUIRE(token.line > line);
    line = token.line;
  }
  // Written and read again it is the same.
  const std::string written = tokens::text_of(*read);
  const auto again = tokens::parse(written, "tokens");
  BUSHD_REQUIRE(again && tokens::text_of(*again) == written);
}

void check_token(std::string_view text) {
  const auto hash = tokens::hash_of(text);
  const std::vector<tokens::Token> kept = {
      {.name = "a", .expires_s = 2, .hash = hash.value_or("")}};
  BUSHD_REQUIRE(tokens::find(kept, text, 1).has_value() == hash.has_value());
  BUSHD_REQUIRE(!tokens::find(kept, text, 2));
  BUSHD_REQUIRE(tokens::is_name(tokens::name_like(text)));
}

}  // namespace
}  // namespace bushd::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  bushd::fuzz::check_file(text);
  bushd::fuzz::check_token(text);
  return 0;
}

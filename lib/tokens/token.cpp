#include "tokens/token.h"

#include <fmt/format.h>
#include <glib.h>

#include <algorithm>
#include <map>
#include <memory>
#include <utility>

#include "base/parse_number.h"
#include "base/printable.h"
#include "base/shortened.h"

namespace bushd::tokens {
namespace {

constexpr std::string_view kDigits = "0123456789abcdefghjkmnpqrstvwxyz";
constexpr std::size_t kTokenLength = kRandomBytes * 8 / 5;
constexpr std::size_t kGroup = 4;
// With all that may be typed between its characters: more is no token, and is not looked at.
constexpr std::size_t kLongestTyped = 256;
constexpr std::size_t kHashLength = 64;
constexpr std::int64_t kMaxUnixS = 253'402'300'799;  // the last second of the year 9999
constexpr std::size_t kFields = 5;
constexpr const char* kLine = "SHA256 NAME EXPIRES_UNIX_S MADE_UNIX_S MADE_BY";
constexpr const char* kRemedy =
    "Remove the line, and make that token again with 'bushctl web-token NAME'";

bool is_blank(char c) {
  return c == ' ' || c == '\t';
}

bool is_control(char c) {
  return (static_cast<unsigned char>(c) < 0x20 && c != '\t') || c == 0x7F;
}

// Not isalnum() and tolower(), which the locale changes.
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}

char small(char c) {
  return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
}

bool is_name_character(char c) {
  const char letter = small(c);
  return (letter >= 'a' && letter <= 'z') || is_digit(c) || c == '_' || c == '.' || c == '-';
}

bool is_hash(std::string_view text) {
  return text.size() == kHashLength &&
         std::ranges::all_of(text, [](char c) { return is_digit(c) || (c >= 'a' && c <= 'f'); });
}

std::optional<std::int64_t> unix_s(std::string_view text) {
  const auto value = parse_number<std::int64_t>(text);
  return value && *value >= 0 && *value <= kMaxUnixS ? value : std::nullopt;
}

std::string quoted(std::string_view text) {
  return fmt::format("\"{}\"", printable(shortened(text)));
}

std::vector<std::string_view> fields_of(std::string_view line) {
  std::vector<std::string_view> fields;
  while (true) {
    while (!line.empty() && is_blank(line.front())) line.remove_prefix(1);
    if (line.empty()) return fields;
    std::size_t end = 0;
    while (end < line.size() && !is_blank(line[end])) ++end;
    fields.push_back(line.substr(0, end));
    line.remove_prefix(end);
  }
}

// The token of this line, or what is wrong with it.
tl::expected<Token, std::string> token_of(const std::vector<std::string_view>& fields) {
  const auto wrong = [](std::string cause) {
    return tl::unexpected<std::string>(std::move(cause));
  };
  if (fields.size() != kFields) {
    return wrong(fmt::format("has {} fields; a token has {}: {}", fields.size(), kFields, kLine));
  }
  if (!is_hash(fields[0])) {
    return wrong(fmt::format("{} is no SHA-256: allowed are {} of 0-9 and a-f", quoted(fields[0]),
                             kHashLength));
  }
  for (const std::size_t i : {std::size_t{1}, std::size_t{4}}) {
    if (!is_name(fields[i])) {
      return wrong(fmt::format("{} is no name: allowed are 1..{} of A-Z, a-z, 0-9, '_', '.', '-'",
                               quoted(fields[i]), kMaxNameLength));
    }
  }
  const auto expires_s = unix_s(fields[2]);
  const auto made_s = unix_s(fields[3]);
  if (!expires_s || !made_s) {
    return wrong(fmt::format("{} is no time: allowed are seconds since 1970, 0..{}",
                             quoted(expires_s ? fields[3] : fields[2]), kMaxUnixS));
  }
  return Token{.name = std::string(fields[1]),
               .expires_s = *expires_s,
               .made_s = *made_s,
               .made_by = std::string(fields[4]),
               .hash = std::string(fields[0])};
}

// Tokens of a file so far; no two have a name or a hash in common.
class Tokens {
 public:
  // What is wrong with one more.
  std::optional<std::string> add(Token token) {
    if (tokens_.size() == kMaxTokens) {
      return fmt::format("is token {} of this file; allowed: {}", kMaxTokens + 1, kMaxTokens);
    }
    const auto [name, new_name] = names_.emplace(token.name, token.line);
    if (!new_name) {
      return fmt::format("the name \"{}\" is that of line {} too", token.name, name->second);
    }
    const auto [hash, new_hash] = hashes_.emplace(token.hash, token.line);
    if (!new_hash) return fmt::format("the hash is that of line {} too", hash->second);
    tokens_.push_back(std::move(token));
    return std::nullopt;
  }
  std::vector<Token> taken() { return std::move(tokens_); }

 private:
  std::vector<Token> tokens_;
  std::map<std::string, int> names_;
  std::map<std::string, int> hashes_;
};

std::string sha256(const std::string& text) {
  const std::unique_ptr<gchar, void (*)(gpointer)> sum(
      g_compute_checksum_for_string(G_CHECKSUM_SHA256, text.data(),
                                    static_cast<gssize>(text.size())),
      g_free);
  return sum.get();
}

// All of both are looked at, wherever they differ. Precondition: they are of one length.
bool is_same(std::string_view a, std::string_view b) {
  unsigned differ = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    differ |= static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i]);
  }
  return differ == 0;
}

}  // namespace

bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= kMaxNameLength &&
         std::ranges::all_of(text, is_name_character);
}

std::string name_like(std::string_view text) {
  std::string name(text.substr(0, kMaxNameLength));
  std::ranges::replace_if(name, [](char c) { return !is_name_character(c); }, '_');
  return name.empty() ? "_" : name;
}

Result<std::vector<Token>> parse(std::string_view text, const std::string& file) {
  if (text.size() > kMaxFileBytes) {
    return fail(Error{.message = fmt::format("has {} bytes; allowed: {}. {} tokens need a fifth of "
                                             "that: is it the file of tokens?",
                                             text.size(), kMaxFileBytes, kMaxTokens),
                      .file = file});
  }
  Tokens tokens;
  for (int line = 1; !text.empty(); ++line) {
    const std::size_t end = text.find('\n');
    const std::string_view content = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    const auto wrong = [&](const std::string& cause) {
      return fail(
          Error{.message = fmt::format("{}. {}", cause, kRemedy), .file = file, .line = line});
    };
    if (const auto* bad = std::ranges::find_if(content, is_control); bad != content.end()) {
      return wrong(fmt::format("has the control character {}, which no line has",
                               printable(std::string_view(bad, 1))));
    }
    const auto fields = fields_of(content);
    if (fields.empty() || fields.front().starts_with('#')) continue;
    auto token = token_of(fields);
    if (!token) return wrong(token.error());
    token->line = line;
    if (const auto cause = tokens.add(std::move(*token))) return wrong(*cause);
  }
  return tokens.taken();
}

std::string text_of(const std::vector<Token>& tokens) {
  std::string text;
  for (const Token& token : tokens) {
    text += fmt::format("{} {} {} {} {}\n", token.hash, token.name, token.expires_s, token.made_s,
                        token.made_by);
  }
  return text;
}

std::string make_token(const std::array<std::uint8_t, kRandomBytes>& random) {
  std::string token;
  for (std::size_t i = 0; i < kTokenLength; ++i) {
    if (i > 0 && i % kGroup == 0) token += '-';
    unsigned digit = 0;
    for (std::size_t bit = i * 5; bit < i * 5 + 5; ++bit) {
      digit = digit << 1 | (random[bit / 8] >> (7 - bit % 8) & 1U);
    }
    token += kDigits[digit];
  }
  return token;
}

std::optional<std::string> hash_of(std::string_view typed) {
  if (typed.size() > kLongestTyped) return std::nullopt;
  std::string token;
  for (const char c : typed) {
    if (is_blank(c) || c == '\n' || c == '\r' || c == '-') continue;
    char digit = small(c);
    if (digit == 'o') digit = '0';
    if (digit == 'i' || digit == 'l') digit = '1';
    if (kDigits.find(digit) == std::string_view::npos) return std::nullopt;
    token += digit;
  }
  if (token.size() != kTokenLength) return std::nullopt;
  return sha256(token);
}

std::optional<Token> find(const std::vector<Token>& tokens, std::string_view typed,
                          std::int64_t now_s) {
  const auto hash = hash_of(typed);
  if (!hash) return std::nullopt;
  const Token* found = nullptr;
  for (const Token& token : tokens) {
    if (token.hash.size() == hash->size() && is_same(token.hash, *hash)) found = &token;
  }
  if (found == nullptr || found->expired(now_s)) return std::nullopt;
  return *found;
}

}  // namespace bushd::tokens

// Tokens by which a page of bushd-web may command. A token is 160 random bits that are shown once,
// as 32 letters and digits; what is kept is their SHA-256. Nobody finds 160 bits by trying, so the
// hash needs neither salt nor slowness.
//
// The file that keeps them has a line for each:
//
//   # a comment
//   SHA256 NAME EXPIRES_UNIX_S MADE_UNIX_S MADE_BY
//
// Blanks or tabs are between the fields. Nothing here reads a clock or makes random bytes: both are
// the caller's.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace bushd::tokens {

inline constexpr std::size_t kMaxTokens = 1000;
inline constexpr std::size_t kMaxFileBytes = 1024 * 1024;
inline constexpr std::size_t kMaxNameLength = 40;
inline constexpr std::size_t kRandomBytes = 20;

struct Token {
  std::string name{};          // 1..40 of [A-Za-z0-9_.-]; no two in a file are the same
  std::int64_t expires_s = 0;  // since 1970; it is no token any more from then on
  std::int64_t made_s = 0;
  std::string made_by{};  // of the form of a name
  std::string hash{};     // 64 hexadecimal digits, small letters
  int line = 0;           // in the file that was parsed, 1-based

  bool expired(std::int64_t now_s) const { return now_s >= expires_s; }
};

bool is_name(std::string_view text);
// What is no name, made one: other characters become '_', and what is too long is cut off.
std::string name_like(std::string_view text);

// Errors name file, line, cause and remedy: too large, too many tokens, a byte that does not belong
// there, a field that is missing, left over or wrong, a name or a hash given twice.
Result<std::vector<Token>> parse(std::string_view text, const std::string& file);
// Their lines.
std::string text_of(const std::vector<Token>& tokens);

// Eight groups of four, "7k3f-...": the letters and digits of Crockford's base 32, which has no i,
// l, o and u.
std::string make_token(const std::array<std::uint8_t, kRandomBytes>& random);
// What make_token() made, as people type it: capitals, '-' and white space do not matter, and o is
// 0, i and l are 1. Nothing if it cannot be a token.
std::optional<std::string> hash_of(std::string_view typed);
// The one that this is, unless it has expired. How long it takes tells nothing of the hashes that
// are kept.
std::optional<Token> find(const std::vector<Token>& tokens, std::string_view typed,
                          std::int64_t now_s);

}  // namespace bushd::tokens

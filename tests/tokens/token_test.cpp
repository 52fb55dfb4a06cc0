#include "tokens/token.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <numeric>

namespace bushd::tokens {
namespace {

using testing::HasSubstr;

constexpr const char* kFile = "/x/tokens";
// Both by another program (Python's hashlib, and its integers).
constexpr const char* kToken = "000g-40r4-0m30-e209-185g-r38e-1w81-24gk";
constexpr const char* kHash = "a616ff8932086f674d362317073730269f6704efb73bdad01f1c61a627d5595d";
constexpr const char* kHashOfOnes =
    "a677edf4f47496d9583d20983b28285fa75b1ed9278ab4c060d361ac3c51abd4";

std::string line(const std::string& name, char digit = 'a',
                 const std::string& rest = "20 10 anna") {
  return std::string(64, digit) + " " + name + " " + rest + "\n";
}

std::array<std::uint8_t, kRandomBytes> counting() {
  std::array<std::uint8_t, kRandomBytes> bytes{};
  std::iota(bytes.begin(), bytes.end(), std::uint8_t{0});
  return bytes;
}

Error error_of(const std::string& text) {
  const auto tokens = parse(text, kFile);
  if (tokens) {
    ADD_FAILURE() << "is taken: " << text;
    return {};
  }
  EXPECT_EQ(tokens.error().file, kFile);
  return tokens.error();
}

TEST(Token, IsFortyCharactersToTypeAndKeptAsItsHash) {
  EXPECT_EQ(make_token(counting()), kToken);
  EXPECT_EQ(hash_of(kToken), kHash);
  std::array<std::uint8_t, kRandomBytes> ones{};
  ones.fill(0xFF);
  EXPECT_EQ(make_token(ones), "zzzz-zzzz-zzzz-zzzz-zzzz-zzzz-zzzz-zzzz");
  EXPECT_EQ(hash_of(make_token(ones)), kHashOfOnes);
}

TEST(Token, IsReadAsPeopleTypeIt) {
  for (const char* typed :
       {"000g40r40m30e209185gr38e1w8124gk", "000G-40R4-0M30-E209-185G-R38E-1W81-24GK",
        "  000g 40r4\t0m30 e209 185g r38e 1w81 24gk\r\n",
        "OoOg-4Or4-0m3o-e2o9-I85g-r38e-lw8L-24gk"}) {
    EXPECT_EQ(hash_of(typed), kHash) << typed;
  }
}

TEST(Token, IsNothingElse) {
  const std::string token = kToken;
  EXPECT_FALSE(hash_of(""));
  EXPECT_FALSE(hash_of(token.substr(1)));
  EXPECT_FALSE(hash_of(token + "0"));
  EXPECT_FALSE(hash_of("u" + token.substr(1)));
  EXPECT_FALSE(hash_of("\xC3" + token.substr(1)));
  EXPECT_FALSE(hash_of(std::string(1, '\0') + token));
  EXPECT_TRUE(hash_of(std::string(200, ' ') + token));
  EXPECT_FALSE(hash_of(std::string(1 << 20, ' ') + token));
}

TEST(Token, IsFoundUntilItExpires) {
  const std::vector<Token> tokens = {
      {.name = "otto", .expires_s = 2000, .hash = kHashOfOnes},
      {.name = "anna", .expires_s = 1000, .made_s = 10, .made_by = "root", .hash = kHash}};
  const auto found = find(tokens, kToken, 999);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->name, "anna");
  EXPECT_EQ(found->expires_s, 1000);
  EXPECT_FALSE(find(tokens, kToken, 1000));
  EXPECT_EQ(find(tokens, std::string(32, 'Z'), 1000)->name, "otto");
  EXPECT_FALSE(find(tokens, std::string(32, '0'), 0));
  EXPECT_FALSE(find(tokens, kHash, 0)) << "who reads the file has no token";
  EXPECT_FALSE(find({}, kToken, 0));
}

TEST(Token, NamesAreForFilesAndLogs) {
  EXPECT_TRUE(is_name("a"));
  EXPECT_TRUE(is_name("Anna_K.-7"));
  EXPECT_TRUE(is_name(std::string(40, 'x')));
  for (const std::string& text :
       {std::string(), std::string(41, 'x'), std::string("a b"), std::string("a\n"),
        std::string("#a"), std::string("a\0", 2), std::string("\xC3\xA4")}) {
    EXPECT_FALSE(is_name(text)) << text;
    EXPECT_TRUE(is_name(name_like(text))) << name_like(text);
  }
  EXPECT_EQ(name_like("LAB\\anna k@x"), "LAB_anna_k_x");
  EXPECT_EQ(name_like("anna"), "anna");
}

TEST(TokenText, IsReadAsItIsWritten) {
  const std::vector<Token> tokens = {
      {.name = "anna", .expires_s = 253402300799, .made_s = 0, .made_by = "root", .hash = kHash},
      {.name = "a.-_Z9", .expires_s = 5, .made_s = 7, .made_by = "1000", .hash = kHashOfOnes}};
  const auto read = parse(text_of(tokens), kFile);
  ASSERT_TRUE(read) << read.error().text();
  ASSERT_EQ(read->size(), 2u);
  EXPECT_EQ(text_of(*read), text_of(tokens));
  EXPECT_EQ((*read)[0].line, 1);
  EXPECT_EQ((*read)[1].line, 2);
  EXPECT_EQ((*read)[1].made_s, 7);
}

TEST(TokenText, HasCommentsEmptyLinesAndPerhapsNoLastNewline) {
  const auto read = parse(
      "# \xC3\xA4\n\n \t \n  # more\n\t" + line("a") + "\n" + line("b", 'b').substr(0, 80), kFile);
  ASSERT_TRUE(read) << read.error().text();
  ASSERT_EQ(read->size(), 2u);
  EXPECT_EQ((*read)[0].line, 5);
  EXPECT_EQ((*read)[1].line, 7);
  EXPECT_EQ((*read)[1].made_by, "anna");
  EXPECT_TRUE(parse("", kFile)->empty());
}

TEST(TokenText, ErrorsNameTheLineTheCauseAndTheRemedy) {
  const struct {
    std::string text;
    std::string cause;
  } cases[] = {{"\x7F", "control character \\x7f"},
               {line("a", 'a', "20 10 anna\r"), "control character \\x0d"},
               {"# a" + std::string(1, '\0') + "b\n", "control character \\x00"},
               {line("a", 'a', "20 10"), "has 4 fields; a token has 5"},
               {line("a", 'a', "20 10 anna too"), "has 6 fields; a token has 5"},
               {line("a", 'A'), "is no SHA-256"},
               {line("a", 'g'), "is no SHA-256"},
               {"a" + line("a"), "is no SHA-256"},
               {line("a").substr(1), "is no SHA-256"},
               {line("a/b"), "\"a/b\" is no name"},
               {line("\xC3\xA4"), "\"\xC3\xA4\" is no name"},
               {line(std::string(41, 'x')), "is no name"},
               {line("a", 'a', "20 10 an\"na"), "is no name"},
               {line("a", 'a', "-1 10 anna"), "\"-1\" is no time"},
               {line("a", 'a', "+1 10 anna"), "\"+1\" is no time"},
               {line("a", 'a', "20 0x10 anna"), "\"0x10\" is no time"},
               {line("a", 'a', "1e9 10 anna"), "is no time"},
               {line("a", 'a', "253402300800 10 anna"), "is no time"},
               {line("a", 'a', "99999999999999999999 10 anna"), "is no time"},
               {line("a", 'b') + line("a", 'c'), "the name \"a\" is that of line 2 too"},
               {line("a", 'b') + line("c", 'b'), "the hash is that of line 2 too"}};
  for (const auto& each : cases) {
    const Error error = error_of("# first\n" + each.text);
    const bool second = each.cause.find("line 2 too") != std::string::npos;
    EXPECT_EQ(error.line, second ? 3 : 2) << each.text;
    EXPECT_THAT(error.message, HasSubstr(each.cause));
    EXPECT_THAT(error.message, HasSubstr("Remove the line, and make that token again"));
  }
}

TEST(TokenText, HasAThousandTokensAndAMebibyteAtMost) {
  std::vector<Token> tokens;
  for (int i = 0; i < 1001; ++i) {
    std::string digits = std::to_string(i);
    tokens.push_back(
        {.name = digits, .made_by = "a", .hash = std::string(64 - digits.size(), 'a') + digits});
  }
  const Error many = error_of(text_of(tokens));
  EXPECT_EQ(many.line, 1001);
  EXPECT_THAT(many.message, HasSubstr("allowed: 1000"));
  tokens.pop_back();
  EXPECT_EQ(parse(text_of(tokens), kFile)->size(), 1000u);
  const std::string filled(1024 * 1024, '#');
  EXPECT_TRUE(parse(filled, kFile));
  EXPECT_THAT(error_of(filled + "#").message, HasSubstr("has 1048577 bytes; allowed: 1048576"));
}

}  // namespace
}  // namespace bushd::tokens

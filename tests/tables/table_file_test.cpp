#include "tables/table_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <rapidcheck.h>
#include <sys/stat.h>
#include <unistd.h>

#include <string>
#include <vector>

#include "results.h"
#include "tables/random_table.h"
#include "tables/temp_directory.h"
#include "tables/toml_file.h"

namespace bushd::tables {
namespace {

using test::good;
using test::TempDirectory;
using testing::HasSubstr;

std::vector<std::uint16_t> codes_of(const bushd_ramp& side) {
  return {side.code, side.code + side.count};
}

TEST(TableFile, SymmetricTableSharesOneSide) {
  const auto table =
      good(parse("name = \"t\"\ntime_unit_ns = 40000\naccel = [250, 20, 10]\n", "t.toml"));
  EXPECT_EQ(table->name(), "t");
  EXPECT_EQ(table->description(), "");
  EXPECT_EQ(table->path(), "t.toml");
  EXPECT_TRUE(table->symmetric());
  const bushd_table& view = table->view();
  EXPECT_EQ(view.time_unit_ns, 40000u);
  EXPECT_EQ(view.cruise, 10);
  EXPECT_EQ(codes_of(view.accel), (std::vector<std::uint16_t>{250, 20, 10}));
  EXPECT_EQ(view.decel.code, view.accel.code);
  EXPECT_EQ(view.decel.sum, view.accel.sum);
  ASSERT_NE(view.accel.sum, nullptr);
  EXPECT_EQ(view.accel.sum[3], 280u);
}

TEST(TableFile, DecelIsListedFastToSlowAndKeptSlowToFast) {
  const auto table =
      good(parse("name = \"t\"\ntime_unit_ns = 1\naccel = [9, 5]\ndecel = [6, 7, 8]\ncruise = 4\n"
                 "description = \"unequal sides\"\n",
                 "t.toml"));
  EXPECT_FALSE(table->symmetric());
  EXPECT_EQ(codes_of(table->view().decel), (std::vector<std::uint16_t>{8, 7, 6}));
  EXPECT_EQ(table->view().cruise, 4);
  EXPECT_EQ(table->description(), "unequal sides");
}

TEST(TableFile, DecelThatMirrorsAccelIsSymmetric) {
  const auto table =
      good(parse("name='t'\ntime_unit_ns=1\naccel=[9,5,1]\ndecel=[1,5,9]\n", "t.toml"));
  EXPECT_TRUE(table->symmetric());
}

TEST(TableFile, ViewAgreesWithTheFileForRandomTables) {
  EXPECT_TRUE(rc::check("codes, cruise and unit survive the file", [] {
    const TableContent content = test::random_case(1).content;
    const auto table = parse(test::file_text(content), "random.toml");
    RC_ASSERT(table.has_value());
    const bushd_table& view = (*table)->view();
    std::vector<std::uint16_t> decel = codes_of(view.decel);
    RC_ASSERT(codes_of(view.accel) == content.accel);
    if (content.decel) {
      std::reverse(decel.begin(), decel.end());
      RC_ASSERT(decel == *content.decel);
    } else {
      RC_ASSERT(decel == content.accel);
    }
    RC_ASSERT(view.cruise == content.cruise.value_or(content.accel.back()));
    RC_ASSERT(view.time_unit_ns == content.time_unit_ns);
    RC_ASSERT(bushd_table_check(&view, nullptr, nullptr) == BUSHD_OK);
  }));
}

struct Refusal {
  const char* what;
  std::string text;
  int line;
  const char* key;
  const char* message;
};

void PrintTo(const Refusal& refusal, std::ostream* out) {
  *out << refusal.what;
}

class TableRefusal : public testing::TestWithParam<Refusal> {};

TEST_P(TableRefusal, NamesFileLineKeyAndWhatIsAllowed) {
  const auto table = parse(GetParam().text, "bad.toml");
  ASSERT_FALSE(table.has_value());
  EXPECT_EQ(table.error().file, "bad.toml");
  EXPECT_EQ(table.error().line, GetParam().line) << table.error().text();
  EXPECT_EQ(table.error().key, GetParam().key) << table.error().text();
  EXPECT_THAT(table.error().message, HasSubstr(GetParam().message));
}

// Lines 1 and 2 of every file below.
const std::string kHead = "name = \"t\"\ntime_unit_ns = 40000\n";

std::string repeated(const std::string& code, std::size_t count) {
  std::string text;
  for (std::size_t i = 0; i < count; ++i) text += code + ",";
  return text;
}

INSTANTIATE_TEST_SUITE_P(
    All, TableRefusal,
    testing::Values(
        Refusal{"MissingName", "time_unit_ns = 1\naccel = [1]\n", 1, "name", "is missing"},
        Refusal{"EmptyName", "time_unit_ns = 1\nname = \"\"\naccel = [1]\n", 2, "name", "1..63"},
        Refusal{"LongName",
                "name = \"" + std::string(64, 'x') + "\"\ntime_unit_ns = 1\naccel = [1]\n", 1,
                "name", "1..63"},
        Refusal{"ControlCharacterInName", "name = \"a\\nb\"\ntime_unit_ns = 1\naccel = [1]\n", 1,
                "name", "control character"},
        Refusal{"NameIsNumber", "name = 3\ntime_unit_ns = 1\naccel = [1]\n", 1, "name",
                "is 3; allowed"},
        Refusal{"MissingUnit", "name = \"t\"\naccel = [1]\n", 1, "time_unit_ns", "is missing"},
        Refusal{"ZeroUnit", "name = \"t\"\ntime_unit_ns = 0\naccel = [1]\n", 2, "time_unit_ns",
                "is 0; allowed: a whole number 1..1000000000"},
        Refusal{"HugeUnit", "name = \"t\"\ntime_unit_ns = 1000000001\naccel = [1]\n", 2,
                "time_unit_ns", "1..1000000000"},
        Refusal{"FloatUnit", "name = \"t\"\ntime_unit_ns = 40000.0\naccel = [1]\n", 2,
                "time_unit_ns", "floating-point number 40000"},
        Refusal{"MissingAccel", kHead, 1, "accel", "is missing"},
        Refusal{"EmptyAccel", kHead + "accel = []\n", 3, "accel", "is empty"},
        Refusal{"AccelIsNumber", kHead + "accel = 250\n", 3, "accel", "is 250; allowed: an array"},
        Refusal{"ZeroCode", kHead + "accel = [\n250,\n0]\n", 5, "accel[1]",
                "is 0; allowed: a whole number 1..65535"},
        Refusal{"NegativeCode", kHead + "accel = [250, -10]\n", 3, "accel[1]", "is -10"},
        Refusal{"CodeOf17Bits", kHead + "accel = [\n65536]\n", 4, "accel[0]", "is 65536"},
        Refusal{"FloatCode", kHead + "accel = [250, 10.5]\n", 3, "accel[1]",
                "floating-point number 10.5"},
        Refusal{"NanCode", kHead + "accel = [nan]\n", 3, "accel[0]", "nan"},
        Refusal{"InfiniteCode", kHead + "accel = [inf]\n", 3, "accel[0]", "inf"},
        Refusal{"StringCode", kHead + "accel = [250, \"10\"]\n", 3, "accel[1]",
                "the string \"10\""},
        Refusal{"NestedCode", kHead + "accel = [250, [10]]\n", 3, "accel[1]", "an array"},
        Refusal{"UnsortedAccel", kHead + "accel = [\n  250, 20,\n  21, 10]\n", 5, "accel[2]",
                "is 21 after 20; allowed: codes that never rise"},
        Refusal{"UnsortedDecel", kHead + "accel = [9]\ndecel = [\n3,\n2,\n9]\n", 6, "decel[1]",
                "is 2 after 3; allowed: codes that never fall"},
        Refusal{"DecelListedLikeAccel", kHead + "accel = [9]\ndecel = [9,\n3]\n", 5, "decel[1]",
                "fast to slow"},
        Refusal{"EmptyDecel", kHead + "accel = [9]\ndecel = []\n", 4, "decel", "accel reversed"},
        Refusal{"ZeroInDecel", kHead + "accel = [9]\ndecel = [0, 9]\n", 4, "decel[0]", "is 0"},
        Refusal{"ZeroCruise", kHead + "accel = [9]\ncruise = 0\n", 4, "cruise", "1..65535"},
        Refusal{"HugeCruise", kHead + "accel = [9]\ncruise = 65536\n", 4, "cruise", "1..65535"},
        Refusal{"DescriptionIsNumber", kHead + "accel = [9]\ndescription = 1\n", 4, "description",
                "a string"},
        Refusal{"UnknownKey", kHead + "accel = [9]\naccell = [9]\n", 4, "accell",
                "unknown key; allowed here: name, description, revision, time_unit_ns, accel, "
                "decel, cruise"},
        Refusal{"FirstUnknownKeyOfTheFile", "zeta = 1\n" + kHead + "accel = [9]\nalpha = 1\n", 1,
                "zeta", "unknown key"},
        Refusal{"UnknownSection", kHead + "accel = [9]\n[motor]\nx = 1\n", 4, "motor",
                "unknown key"},
        Refusal{"DuplicateKey", kHead + "accel = [9]\naccel = [8]\n", 4, "", "not TOML"},
        Refusal{"SyntaxError", kHead + "accel = [9\n", 3, "", "not TOML"},
        Refusal{"TooManyCodes", kHead + "accel = [" + repeated("9", 65536) + "]\n", 3, "accel",
                "65536 codes in all; allowed: 65535"},
        Refusal{"TooManyCodesOnBothSides",
                kHead + "accel = [" + repeated("9", 65535) + "]\ndecel = [9]\n", 4, "decel",
                "65536 codes"},
        Refusal{"RampLongerThan31Bits", kHead + "accel = [" + repeated("65535", 40000) + "]\n", 3,
                "accel[32768]", "add up to more than 2147483647 time units"}),
    [](const auto& tested) { return std::string(tested.param.what); });

TEST(TableFile, LongestTableIsAccepted) {
  const auto table = parse(kHead + "accel = [" + repeated("9", 65535) + "]\n", "long.toml");
  EXPECT_TRUE(table.has_value());
}

// Whatever the bytes are, the answer is an Error.
TEST(HostileTableFile, DeepArraysAreRefused) {
  const auto table = parse(kHead + "accel = " + std::string(1'000'000, '['), "deep.toml");
  ASSERT_FALSE(table.has_value());
  EXPECT_EQ(table.error().line, 3);
}

TEST(HostileTableFile, DeepInlineTablesAreRefused) {
  std::string text = kHead + "accel = ";
  for (int i = 0; i < 100'000; ++i) text += "{a=";
  EXPECT_FALSE(parse(text, "deep.toml").has_value());
}

TEST(HostileTableFile, DeepDottedKeysAreRefused) {
  std::string key = "a";
  for (int i = 0; i < 500'000; ++i) key += ".a";
  const std::string spaced = "a . \"=\" . '#' . " + key;
  for (const std::string& text :
       {key + " = 1\n", "[" + key + "]\n", "[[" + key + "]]\n", "x = {" + key + " = 1}\n",
        "x = \"\"\"a\"\"\"\"\n" + key + " = 1\n", "x = '''a'''''\n" + key + " = 1\n",
        "x = {y = \"\"\"a\"\"\"\"\", " + key + " = 1}\n", "x = [1, '#'] # '''\n" + key + " = 1\n",
        "x = \"\\\"\"\n" + key + " = 1\n", "x = ''\n" + key + " = 1\n", spaced + " = 1\n"}) {
    const auto table = parse(kHead + text, "deep.toml");
    ASSERT_FALSE(table.has_value());
    EXPECT_THAT(table.error().message, HasSubstr("more than 16 parts")) << text.substr(0, 30);
    EXPECT_GT(table.error().column, 0);
  }
}

TEST(HostileTableFile, DeepestKeysInDeepestValuesAreRefusedWithoutACrash) {
  std::string text = kHead;
  const std::string key = "a.a.a.a.a.a.a.a.a.a.a.a.a.a.a.a";
  for (int i = 0; i < 300; ++i) text += (i == 0 ? key : "{" + key) + "=";
  EXPECT_FALSE(parse(text, "deep.toml").has_value());
  text = kHead + "[" + key + "]\n";
  for (int i = 0; i < 100; ++i) text += (i == 0 ? key : "{" + key) + "=";
  text += "1" + std::string(99, '}') + "\n";
  const auto table = parse(text, "deep.toml");
  ASSERT_FALSE(table.has_value());
  EXPECT_EQ(table.error().key, "a");
}

TEST(HostileTableFile, DotsThatAreNotKeysCostNothing) {
  const std::string dots(200, '.');
  const auto table =
      good(parse("# " + dots + "\nname = \"t\"\ntime_unit_ns = 1\naccel = [1]\n" +
                     "description = \"\"\"" + dots + "\n\\\"\"\" " + dots + "\"\"\" # " + dots,
                 "dots.toml"));
  const auto floats = parse(kHead + "accel = [" + repeated("1.5", 100) + "]\n", "floats.toml");
  ASSERT_FALSE(floats.has_value());
  EXPECT_EQ(floats.error().key, "accel[0]");
}

TEST(HostileTableFile, BytesThatAreNotUtf8AreRefusedWhereTheyAre) {
  for (const std::string& bytes : {std::string("\xC3\x28"), std::string("\xFF"),
                                   std::string("\xED\xA0\x80"), std::string(1, '\0')}) {
    const auto table =
        parse(kHead + "description = \"ä" + bytes + "\"\naccel = [9]\n", "bytes.toml");
    ASSERT_FALSE(table.has_value());
    EXPECT_EQ(table.error().line, 3);
    EXPECT_EQ(table.error().column, 17);
    EXPECT_THAT(table.error().message, HasSubstr("is not text; allowed: UTF-8"));
  }
}

TEST(HostileTableFile, NulBytesAreRefused) {
  EXPECT_FALSE(parse(std::string(4096, '\0'), "zeros.toml").has_value());
}

TEST(HostileTableFile, RandomAndDamagedBytesNeverCrash) {
  EXPECT_TRUE(rc::check("parse returns", [] {
    std::string text = test::file_text(test::random_case(1).content);
    const auto damage = *rc::gen::arbitrary<std::vector<std::pair<std::uint16_t, char>>>();
    for (const auto& [at, byte] : damage) text[at % text.size()] = byte;
    const auto table = parse(text, "damaged.toml");
    RC_ASSERT(table.has_value() || !table.error().message.empty());
    const auto noise = parse(*rc::gen::arbitrary<std::string>(), "noise.toml");
    RC_ASSERT(!noise.has_value());
  }));
}

TEST(TableLoad, MissingFileNamesThePath) {
  const TempDirectory directory;
  const std::string path = directory.path() / "none.toml";
  const auto table = load(path);
  ASSERT_FALSE(table.has_value());
  EXPECT_EQ(table.error().text(), path + ": cannot be read: No such file or directory");
}

TEST(TableLoad, FolderAndFifoAreRefusedWithoutBlocking) {
  const TempDirectory directory;
  EXPECT_THAT(load(directory.path()).error().message, HasSubstr("not a regular file"));
  const std::string fifo = directory.path() / "fifo";
  ASSERT_EQ(mkfifo(fifo.c_str(), 0600), 0);
  EXPECT_THAT(load(fifo).error().message, HasSubstr("not a regular file"));
}

TEST(TableLoad, FileBeyondTheCapIsRefused) {
  const TempDirectory directory;
  const auto path = directory.write("big.toml", std::string(kMaxFileBytes + 1, '\n'));
  EXPECT_THAT(load(path).error().message, HasSubstr("larger than"));
}

TEST(TextFile, FoldersAndDevicesAreRefusedAndPipesWhereTheyMayBe) {
  const TempDirectory directory;
  const auto refusal = [](const std::filesystem::path& path) {
    const auto text = read_text(path, kNumbersLimit);
    return text ? "none" : text.error().message;
  };
  EXPECT_THAT(refusal(directory.path()), HasSubstr("it is a folder"));
  EXPECT_THAT(refusal("/dev/zero"), HasSubstr("not a regular file"));
  // Both ends of a pipe are in this process: what is written fits into it.
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  ASSERT_EQ(write(ends[1], "a\n1\n", 4), 4);
  close(ends[1]);
  EXPECT_EQ(read_text("/dev/fd/" + std::to_string(ends[0]), kNumbersLimit).value_or("none"),
            "a\n1\n");
  close(ends[0]);
  const auto longer = directory.write("rows.csv", std::string(kMaxFileBytes + 1, '\n'));
  EXPECT_EQ(read_text(longer, kNumbersLimit).value_or("").size(), kMaxFileBytes + 1);
  EXPECT_THAT(read_text(longer, TextLimit{.bytes = 10, .told = "ten do"}).error().message,
              HasSubstr("larger than 10 bytes, and ten do"));
}

TEST(TableFind, FirstDirectoryWins) {
  const TempDirectory directory;
  directory.write("a/t.toml", "");
  directory.write("b/t.toml", "");
  directory.write("b/u.toml", "");
  const std::vector<std::filesystem::path> order = {directory.path() / "a", directory.path() / "b"};
  EXPECT_EQ(find("t", order).value(), order[0] / "t.toml");
  EXPECT_EQ(find("u", order).value(), order[1] / "u.toml");
  const auto none = find("v", order);
  ASSERT_FALSE(none.has_value());
  EXPECT_THAT(none.error().message, HasSubstr(order[0].string() + ", " + order[1].string()));
}

TEST(TableFind, NamesThatLeadElsewhereAreRefused) {
  const TempDirectory directory;
  directory.write("t.toml", "");
  directory.write("sub/x.toml", "");
  const std::vector<std::filesystem::path> order = {directory.path() / "sub"};
  for (const char* name : {"", ".", "..", "../t", "/t", ".x", "x/../x", "t@1", "t\n"}) {
    EXPECT_THAT(find(name, order).error().message, HasSubstr("is not a table's name")) << name;
  }
  EXPECT_FALSE(find(std::string_view("x\0y", 3), order).has_value());
}

TEST(TableFind, EnvironmentComesBeforeTheShippedTables) {
  const TempDirectory directory;
  directory.write("bushd2-constant.toml", "");
  ASSERT_EQ(setenv("BUSHD_TABLES_DIR", directory.path().c_str(), 1), 0);
  const auto own = find("bushd2-constant", shipped_directories());
  ASSERT_EQ(unsetenv("BUSHD_TABLES_DIR"), 0);
  EXPECT_EQ(own.value(), directory.path() / "bushd2-constant.toml");
  EXPECT_NE(find("bushd2-constant", shipped_directories()).value(), own.value());
}

}  // namespace
}  // namespace bushd::tables

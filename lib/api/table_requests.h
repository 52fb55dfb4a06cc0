// Requests about table files and about programs of MCUs. (What all requests have in common:
// api/request.h.)
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "api/table_file.h"
#include "api/words.h"
#include "base/fields.h"

namespace bushd::api {

inline constexpr fields::Field kTableWithRevision{"table", "NAME, NAME@REVISION or NAME@TAG"};

struct UseTable {
  std::string group{};
  std::string table{};

  static constexpr std::string_view kName = "use table";
  static constexpr std::string_view kMeaning =
      "Gives a group another table from its next move on, as soon as its MCUs stand. A later "
      "request for the same group ends this one with stopped.";
  static constexpr std::string_view kResult = "done, once all MCUs of the group have the table";
  static constexpr Motion motion() { return Motion::kNone; }
  static void fields(auto& self, auto& visit) {
    visit("group", self.group);
    visit(kTableWithRevision, self.table);
  }
  friend bool operator==(const UseTable&, const UseTable&) = default;
};

struct ReloadTables {
  static constexpr std::string_view kName = "reload tables";
  static constexpr std::string_view kMeaning = "Reads the tables of all groups again.";
  static constexpr std::string_view kResult =
      "done; fault if the table of one of several groups was not valid and the old one stays; "
      "refused if no table that has changed is valid";
  static constexpr Motion motion() { return Motion::kNone; }
  static void fields(auto& /*self*/, auto& /*visit*/) {}
  friend bool operator==(const ReloadTables&, const ReloadTables&) = default;
};

struct ListTables {
  static constexpr std::string_view kName = "list tables";
  static constexpr std::string_view kMeaning =
      "Which tables there are. Answered by table_answer_t.";
  static constexpr Motion motion() { return Motion::kNone; }
  static constexpr bool is_repeatable() { return true; }
  static void fields(auto& /*self*/, auto& /*visit*/) {}
  friend bool operator==(const ListTables&, const ListTables&) = default;
};

struct GetTable {
  std::string table{};

  static constexpr std::string_view kName = "get table";
  static constexpr std::string_view kMeaning = "What a table says. Answered by table_answer_t.";
  static constexpr Motion motion() { return Motion::kNone; }
  static constexpr bool is_repeatable() { return true; }
  static void fields(auto& self, auto& visit) { visit(kTableWithRevision, self.table); }
  friend bool operator==(const GetTable&, const GetTable&) = default;
};

struct SetTable {
  std::string table{};
  TableFile content{};
  std::string expected_hash{};

  static constexpr std::string_view kName = "set table";
  static constexpr std::string_view kMeaning =
      "The table gets this content as its next revision, or is made; nothing is put in service. A "
      "file that has the content already stays as it is. Answered by table_answer_t with the table "
      "as it is now.";
  static constexpr Motion motion() { return Motion::kNone; }
  static void fields(auto& self, auto& visit) {
    visit({"table", "NAME"}, self.table);
    visit({"expected_hash",
           "`hash` of the content that this one was made from, as get_table_t told it; the "
           "`revision` is in the content. If the table is another by now, it is left alone. \"\": "
           "the table is new"},
          self.expected_hash);
    visit({"content", "its hash does not matter"}, self.content);
  }
  friend bool operator==(const SetTable&, const SetTable&) = default;
};

struct PutProgram {
  static constexpr std::size_t kMostBytes = 56 * 1024;  // of all its texts: they are one message

  struct Points {
    std::string file{};
    std::string text{};

    static constexpr std::string_view kName = "program points";
    static constexpr std::string_view kMeaning =
        "A file of points that the text of a program names.";
    static void fields(auto& self, auto& visit) {
      visit({"file", "as the text names it"}, self.file);
      visit({"text", "rows of numbers with commas between them"}, self.text);
    }
    friend bool operator==(const Points&, const Points&) = default;
  };
  std::string program{};
  std::string text{};
  std::vector<Points> points{};
  bool dry_run = false;

  static constexpr std::string_view kName = "put program";
  static constexpr std::string_view kMeaning =
      "The program (docs/programs.md) goes into the memory of the MCU of its motors, in place of "
      "the one there. It is checked as things are, then sent; nothing of it runs before it has "
      "arrived whole. Refused while a program of that MCU is under way. Answered by "
      "program_reply_t with this one.";
  static constexpr std::string_view kResult = "done, once it has arrived whole";
  static constexpr Motion motion() { return Motion::kNone; }
  static void fields(auto& self, auto& visit) {
    visit({"program", "its name: 1 to 63 of A-Z a-z 0-9 _ . -, the first one no -"}, self.program);
    visit({"text", "TOML"}, self.text);
    visit.list("file_count", "points", self.points);
    visit({"dry_run", "it is checked, and what it would do is told"}, self.dry_run);
  }
  friend bool operator==(const PutProgram&, const PutProgram&) = default;
};

struct EraseProgram {
  std::string program{};

  static constexpr std::string_view kName = "erase program";
  static constexpr std::string_view kMeaning =
      "The program goes out of the memory of its MCU. Refused while it is under way.";
  static constexpr std::string_view kResult = "done";
  static constexpr Motion motion() { return Motion::kNone; }
  static void fields(auto& self, auto& visit) { visit("program", self.program); }
  friend bool operator==(const EraseProgram&, const EraseProgram&) = default;
};

struct RunPrograms {
  std::vector<std::string> programs{};

  static constexpr std::string_view kName = "run programs";
  static constexpr std::string_view kMeaning =
      "These programs, of MCUs of one bus, begin with the same tick, or none does. Their motors "
      "are at rest. Stop, pause and resume of one of its motors are for the whole program.";
  static constexpr std::string_view kResult =
      "reached, when all have come to their ends; the reason names the frame at which each has "
      "ended, and why";
  static constexpr Motion motion() { return Motion::kBeginsByService; }
  static void fields(auto& self, auto& visit) {
    visit.list({"program_count", "at least 1, none twice"}, "programs", self.programs);
  }
  friend bool operator==(const RunPrograms&, const RunPrograms&) = default;
};

struct ListPrograms {
  static constexpr std::string_view kName = "list programs";
  static constexpr std::string_view kMeaning =
      "The programs of all MCUs that can have one, and how far they are. Answered by "
      "program_reply_t.";
  static constexpr std::string_view kResult = "done";
  static constexpr Motion motion() { return Motion::kNone; }
  static constexpr bool is_repeatable() { return true; }
  static void fields(auto& /*self*/, auto& /*visit*/) {}
  friend bool operator==(const ListPrograms&, const ListPrograms&) = default;
};

}  // namespace bushd::api

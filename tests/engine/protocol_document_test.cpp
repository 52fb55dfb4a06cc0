// docs/protocol.md is normative, so what it prints in hexadecimal must be what the code does. In
// its blocks marked `frame` and `exchange` lines begin with
// - wire HEX: a frame on the bus
// - raw HEX: the same without COBS and delimiter
// - master HEX: sent to an MCU
// - mcu HEX: which must answer just that, at once or
// - begins N: N us after the master's frame
// - says TEXT: what the frame above means (message_text)
// - ticks N: N tick boundaries pass
#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "engine/frame.h"
#include "engine/message_text.h"
#include "firmware/core/mcu_state.h"
#include "source_path.h"

namespace bushd::test {
namespace {

using Bytes = std::vector<uint8_t>;

struct Line {
  int number;
  std::string keyword;
  std::string rest;

  Bytes bytes() const {
    Bytes out;
    std::istringstream hex(rest);
    for (std::string byte; hex >> byte;) {
      out.push_back(static_cast<uint8_t>(std::stoi(byte, nullptr, 16)));
    }
    return out;
  }
};

// The lines of all blocks of a kind; a line that is indented continues the one before.
std::vector<Line> lines_of(const std::string& kind) {
  std::ifstream file(source_path("docs/protocol.md"));
  EXPECT_TRUE(file) << "docs/protocol.md";
  std::vector<Line> lines;
  bool inside = false;
  int number = 0;
  for (std::string text; std::getline(file, text);) {
    ++number;
    if (text.rfind("```", 0) == 0) {
      inside = !inside && text == "```" + kind;
      continue;
    }
    if (!inside || text.empty()) continue;
    const size_t word = text.find_first_not_of(' ');
    if (word > 0) {
      lines.back().rest += text.substr(word - 1);
      continue;
    }
    const size_t space = text.find(' ');
    lines.push_back(
        {number, text.substr(0, space), text.substr(text.find_first_not_of(' ', space))});
  }
  EXPECT_FALSE(lines.empty()) << "no block of kind " << kind;
  return lines;
}

std::string hex(const Bytes& bytes) {
  std::string out;
  for (const uint8_t byte : bytes) {
    char text[4];
    std::snprintf(text, sizeof text, "%s%02X", out.empty() ? "" : " ", byte);
    out += text;
  }
  return out;
}

// "ADDRESS TAG MESSAGE FIELDS" of the one frame among these bytes.
std::string meaning(const Bytes& wire) {
  bushd_receiver receiver{};
  std::string out;
  for (const uint8_t byte : wire) {
    bushd_frame frame;
    const bushd_receive received = bushd_receive_byte(&receiver, byte, &frame);
    if (received == BUSHD_RECEIVE_MORE) continue;
    if (received != BUSHD_RECEIVE_FRAME) return "broken frame";
    out += (out.empty() ? "" : " and ") + std::string("address=") + std::to_string(frame.address) +
           " sequence=" + std::to_string(frame.sequence) + " " + message_text(frame);
  }
  return out;
}

TEST(ProtocolDocument, DecodedFramesAreRight) {
  Bytes wire;
  for (const Line& line : lines_of("frame")) {
    SCOPED_TRACE("docs/protocol.md:" + std::to_string(line.number));
    if (line.keyword == "wire") {
      wire = line.bytes();
    } else if (line.keyword == "raw") {
      const Bytes raw = line.bytes();
      ASSERT_GE(raw.size(), BUSHD_FRAME_HEADER + BUSHD_FRAME_CRC);
      Bytes again(BUSHD_FRAME_MAX_WIRE);
      again.resize(bushd_frame_encode(raw[0], raw[1], raw[2], raw.data() + BUSHD_FRAME_HEADER,
                                      raw.size() - BUSHD_FRAME_HEADER - BUSHD_FRAME_CRC,
                                      again.data()));
      EXPECT_EQ(hex(again), hex(wire));
      EXPECT_EQ(~bushd_crc32(BUSHD_CRC32_START, raw.data(), raw.size() - BUSHD_FRAME_CRC),
                bushd_get_u32(&raw[raw.size() - BUSHD_FRAME_CRC]));
    } else if (line.keyword == "says") {
      EXPECT_EQ(meaning(wire), line.rest);
    } else {
      ADD_FAILURE() << "unknown keyword " << line.keyword;
    }
  }
}

// A row of a drawing, as the table of the engine has it: names, or types.
std::vector<std::string> row_below(const std::string& heading, bool names) {
  std::ifstream file(source_path("docs/protocol.md"));
  std::vector<std::string> row;
  bool found = false;
  for (std::string text; row.empty() && std::getline(file, text);) {
    found |= text == heading;
    if (!found) continue;
    if (names && text.rfind("    | ", 0) == 0) {
      std::istringstream cells(text.substr(6));
      for (std::string cell; std::getline(cells, cell, '|');) {
        cell = cell.substr(0, cell.find_last_not_of(' ') + 1);
        cell.erase(0, cell.find_first_not_of(' '));
        std::ranges::replace_if(cell, [](char c) { return c == ' ' || c == '-'; }, '_');
        if (!cell.empty()) row.push_back(cell);
      }
    } else if (!names && (text.rfind("     u", 0) == 0 || text.rfind("     i", 0) == 0)) {
      std::istringstream cells(text);
      for (std::string cell; cells >> cell;) row.push_back(cell);
    }
  }
  return row;
}

// One table describes a report to both ends; this page draws the same.
TEST(ProtocolDocument, DrawsTheSectionsOfAReportAsTheTableHasThem) {
  const std::map<std::string, std::string> types = {
      {"8", "u8"}, {"16", "u16"}, {"32", "u32"}, {"S32", "i32"}};
  using Row = std::vector<std::string>;
#define NAME_OF(type, name) #name,
#define TYPE_OF(type, name) types.at(#type),
#define EXPECT_DRAWN(heading, fields)                          \
  EXPECT_EQ(row_below(heading, true), (Row{fields(NAME_OF)})); \
  EXPECT_EQ(row_below(heading, false), (Row{fields(TYPE_OF)}));
#define EXPECT_SECTION(name, bit, fields) \
  EXPECT_DRAWN(#name ", section " + std::to_string(1 << (bit)), fields)
  EXPECT_DRAWN("### 89 report", BUSHD_REPORT_BASE)
  EXPECT_DRAWN("For each motor that is named", BUSHD_REPORT_MOTOR)
  BUSHD_REPORT_SECTIONS(EXPECT_SECTION)
}

// The MCU of the exchange: address 1, two motors, boot number 4660, unique id 1 .. 8. Every request
// ends 100 us into a tick.
class ExampleMcu {
 public:
  ExampleMcu() {
    bushd_port port{};
    port.context = this;
    port.transmit = [](void* context, const uint8_t* wire, size_t size, uint32_t delay_ns) {
      auto* const self = static_cast<ExampleMcu*>(context);
      self->sent_.assign(wire, wire + size);
      self->delay_us_ = static_cast<int>(delay_ns / 1000);
    };
    port.store_address = [](void*, uint8_t) { return true; };
    port.set_enable = [](void*, bool, const bushd_set_outputs*, bushd_edge) {};
    port.set_tick = [](void*, uint32_t) {};
    port.adjust_tick = [](void*, int32_t) {};
    port.time_in_tick_ns = [](void*) { return kTimeInTickNs; };
    port.read_inputs = [](void*) { return bushd_inputs{}; };
    port.read_current = [](void*) { return uint16_t{0}; };
    port.self_test = [](void*) { return uint8_t{0}; };
    port.keep_enable = [](void*, bool) {};
    bushd_mcu_config config{};
    config.address = 1;
    config.motors = 2;
    config.slots = 128;
    config.boot_number = 4660;
    config.reset_cause = BUSHD_RESET_POWER_ON;
    config.queue = queue_;
    config.queue_ticks = 256;
    config.codes = codes_;
    config.code_count = 2048;
    config.reply = reply_;
    for (uint8_t i = 0; i < BUSHD_UNIQUE_ID_SIZE; ++i) config.unique_id[i] = i + 1;
    bushd_mcu_boot(&mcu_, &port, &config);
  }

  Bytes answer(const Bytes& request) {
    sent_.clear();
    delay_us_ = 0;
    for (const uint8_t byte : request) bushd_mcu_receive(&mcu_, byte, kTimeInTickNs);
    return sent_;
  }

  // The delay of the last answer.
  int delay_us() const { return delay_us_; }

  void pass_ticks(int count) {
    for (int i = 0; i < count; ++i) {
      bushd_mcu_swap(&mcu_);
      bushd_mcu_prepare(&mcu_);
    }
  }

 private:
  static constexpr uint32_t kTimeInTickNs = 100'000;

  bushd_mcu mcu_{};
  int16_t queue_[256 * 2]{};
  uint16_t codes_[2048]{};
  uint8_t reply_[BUSHD_MCU_MAX_REPLY]{};
  Bytes sent_;
  int delay_us_ = 0;
};

TEST(ProtocolDocument, TheExchangeIsWhatTheFirmwareCoreAnswers) {
  ExampleMcu mcu;
  Bytes last;
  Bytes answer;
  int delay_us = 0;
  for (const Line& line : lines_of("exchange")) {
    SCOPED_TRACE("docs/protocol.md:" + std::to_string(line.number));
    if (line.keyword == "master") {
      EXPECT_EQ(hex(answer), "") << "an answer that the document does not print";
      last = line.bytes();
      answer = mcu.answer(last);
      delay_us = mcu.delay_us();
    } else if (line.keyword == "begins") {
      EXPECT_EQ(delay_us, std::stoi(line.rest));
      delay_us = 0;
    } else if (line.keyword == "mcu") {
      last = line.bytes();
      EXPECT_EQ(hex(answer), hex(last));
      EXPECT_EQ(delay_us, 0) << "a time that the document does not print";
      answer.clear();
    } else if (line.keyword == "says") {
      EXPECT_EQ(meaning(last), line.rest);
    } else if (line.keyword == "ticks") {
      mcu.pass_ticks(std::stoi(line.rest));
    } else {
      ADD_FAILURE() << "unknown keyword " << line.keyword;
    }
  }
}

}  // namespace
}  // namespace bushd::test

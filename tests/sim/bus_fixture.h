// A master for tests: speaks with the engine's encoders, reads with the engine's receiver.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "engine/frame.h"
#include "engine/message.h"
#include "sim/bus.h"
#include "sim/requests.h"

namespace bushd::sim {

using Bytes = std::vector<std::uint8_t>;
using test::payload_of;

// What these bytes say; nothing if they are no such message.
template <class Message>
std::optional<Message> decoded(const Bytes& payload,
                               bushd_status (*decode)(const std::uint8_t*, std::size_t, Message*)) {
  Message message{};
  if (decode(payload.data(), payload.size(), &message) != BUSHD_OK) return std::nullopt;
  return message;
}

// Codes from `first` down.
inline std::vector<std::uint16_t> falling_codes(std::uint16_t first, std::size_t count) {
  std::vector<std::uint16_t> codes;
  while (codes.size() < count) codes.push_back(first--);
  return codes;
}

// Keeps edges per MCU as they come and checks what an EdgeSink is promised.
class Recorder final : public EdgeSink {
 public:
  void edge(const Edge& edge) override {
    EXPECT_GE(edge.time_ns, settled_ns_) << "an edge before a time that was said to be settled";
    EXPECT_GE(edge.time_ns, last_ns_[edge.mcu]) << "edges of one MCU out of order";
    last_ns_[edge.mcu] = edge.time_ns;
    edges.push_back(edge);
  }
  void sample(const Sample& sample) override { samples.push_back(sample); }
  void settled(TimeNs until_ns) override {
    EXPECT_GE(until_ns, settled_ns_);
    settled_ns_ = until_ns;
  }

  std::vector<TimeNs> times(std::size_t mcu, Signal signal, std::uint8_t index, bool level) const {
    std::vector<TimeNs> out;
    for (const Edge& e : edges) {
      if (e.mcu == mcu && e.signal == signal && e.index == index && e.level == level) {
        out.push_back(e.time_ns);
      }
    }
    return out;
  }

  std::vector<Edge> edges;
  std::vector<Sample> samples;

 private:
  TimeNs settled_ns_ = 0;
  std::array<TimeNs, 8> last_ns_{};
};

struct Frame {
  std::uint8_t address;
  std::uint8_t type;
  std::uint8_t sequence;
  Bytes payload;
  TimeNs end_ns;
};

// An MCU of this kind, for Bus::add_mcu.
template <class Kind, class Options>
Bus::MakeMcu mcu_of(const Options& options) {
  return [options](std::size_t index, Mcu::Driver& driver, EdgeSink* sink) {
    return std::make_unique<Kind>(options, index, driver, sink);
  };
}

// A master that sends the frames which a test gives it, and collects those that are received.
class FrameMaster {
 public:
  explicit FrameMaster(Bus& bus) : bus_(bus) {
    bus_.on_master_byte = [this](std::uint8_t byte, TimeNs end_ns) {
      bushd_frame frame;
      const bushd_receive got = bushd_receive_byte(&receiver_, byte, &frame);
      if (got == BUSHD_RECEIVE_FRAME) {
        frames.push_back({frame.address, frame.type, frame.sequence,
                          Bytes(frame.payload, frame.payload + frame.payload_size), end_ns});
      } else if (got != BUSHD_RECEIVE_MORE) {
        ++bad_frames;
      }
    };
  }

  static Bytes wire(std::uint8_t address, std::uint8_t type, std::uint8_t sequence,
                    std::span<const std::uint8_t> payload) {
    Bytes out(BUSHD_FRAME_MAX_WIRE);
    out.resize(
        bushd_frame_encode(address, type, sequence, payload.data(), payload.size(), out.data()));
    return out;
  }

  // Sends now, behind a delimiter as everybody who takes the line does.
  void post(std::uint8_t address, std::uint8_t type, std::span<const std::uint8_t> payload) {
    // Who has which address may change.
    if (type == BUSHD_MSG_SET_ADDRESS) told_.clear();
    bus_.master_send(Bytes{0}, bus_.now_ns());
    bus_.master_send(wire(address, type, ++sequence_, payload), bus_.now_ns());
  }

  // The same, and lets time pass until the wire is silent.
  void send(std::uint8_t address, std::uint8_t type, std::span<const std::uint8_t> payload) {
    post(address, type, payload);
    drain();
  }

  template <class Message>
  void broadcast(const Message& message) {
    const test::Request request = test::request_of(message);
    send(BUSHD_ADDRESS_BROADCAST, request.type, request.payload);
  }

  void drain() {
    TimeNs silent_ns;
    do {
      silent_ns = std::max(bus_.wire_busy_until_ns(), bus_.now_ns());
      bus_.advance_to(silent_ns + patience_ns);
    } while (bus_.wire_busy_until_ns() > silent_ns);
  }

  // The reply to a request; nothing if none came.
  std::optional<Frame> request(std::uint8_t address, std::uint8_t type,
                               std::span<const std::uint8_t> payload = {}) {
    return request(address, type, payload, address);
  }
  // The same of one that is broadcast.
  std::optional<Frame> request(std::uint8_t address, std::uint8_t type,
                               std::span<const std::uint8_t> payload, std::uint8_t answering) {
    frames.clear();
    send(address, type, payload);
    for (const Frame& frame : frames) {
      if (frame.address == answering && frame.type == (type | BUSHD_TYPE_REPLY) &&
          frame.sequence == sequence_) {
        return frame;
      }
    }
    return std::nullopt;
  }

  std::optional<bushd_identity> identify(std::uint8_t address) {
    const auto reply = request(address, BUSHD_MSG_IDENTIFY, Bytes{0, 0, 1, 0, 0});
    return reply ? decoded(reply->payload, bushd_decode_identity) : std::nullopt;
  }
  // All good answers of a broadcast scan.
  std::vector<Frame> scan(const bushd_identify& message) {
    frames.clear();
    broadcast(message);
    return frames;
  }

  // The status that an MCU acknowledges a request with; BUSHD_E_LENGTH if no good reply came.
  template <class Message>
  bushd_status acknowledged(std::uint8_t address, const Message& message) {
    const test::Request request = test::request_of(message);
    return acknowledged(address, request.type, request.payload);
  }
  bushd_status acknowledged(std::uint8_t address, std::uint8_t type,
                            std::span<const std::uint8_t> payload) {
    const auto reply = request(address, type, payload);
    bushd_acknowledgement ack{BUSHD_E_LENGTH};
    if (!reply || bushd_decode_acknowledgement(reply->payload.data(), reply->payload.size(),
                                               &ack) != BUSHD_OK) {
      return BUSHD_E_LENGTH;
    }
    return static_cast<bushd_status>(ack.status);
  }

  // What is new since the report before, and with it all that the MCU has told.
  bushd_report poll(std::uint8_t address) {
    bushd_report& report = told_[address];
    frames.clear();
    const Bytes payload = {1, address, 0, 0, report.number, 255};
    send(BUSHD_ADDRESS_BROADCAST, BUSHD_MSG_POLL, payload);
    if (frames.size() != 1 || frames[0].address != address) {
      ADD_FAILURE() << "no report from " << int{address};
      return {};
    }
    const Bytes& reply = frames[0].payload;
    bushd_report news = report;
    if (news.number == 0) news.motor_count = BUSHD_MOTORS_PER_MCU;
    EXPECT_EQ(bushd_decode_report(reply.data(), reply.size(), &news), BUSHD_OK);
    EXPECT_TRUE(report.number != 0 || bushd_report_is_whole(&news));
    report = news;
    return report;
  }
  // The next poll of it asks for all.
  void forget_report(std::uint8_t address) { told_.erase(address); }

  bushd_tables tables(std::uint8_t address) {
    return answer(address, BUSHD_MSG_TABLES, bushd_decode_tables);
  }
  bushd_program_state program_state(std::uint8_t address) {
    return answer(address, BUSHD_MSG_PROGRAM_STATE, bushd_decode_program_state);
  }
  std::size_t valid_tables(std::uint8_t address) {
    const bushd_tables told = tables(address);
    return static_cast<std::size_t>(
        std::count_if(std::begin(told.bank), std::end(told.bank), [](auto& t) { return t.valid; }));
  }

  // A SYNC to all; returns its sync id.
  std::uint32_t sync(bushd_sync message) {
    message.master = 1;
    message.sync_id = ++sync_id_;
    broadcast(message);
    return sync_id_;
  }

  // Sets tick and format and puts all MCUs in step with the first one, as
  // docs/decisions/0002-time-synchronisation.md has it: SYNC, question to the first, SYNC with the
  // answer. On a fresh bus the first SYNC is tick 0.
  void bring_up(std::uint32_t tick_ns, bushd_format format) {
    bus_.advance_to(bus_.now_ns() + 10 * TimeNs{tick_ns});  // all have booted
    for (std::size_t i = 0; i < bus_.mcu_count(); ++i) {
      const bushd_configure configure{tick_ns, format, 1000};
      ASSERT_EQ(acknowledged(bus_.node(i).address(), configure), BUSHD_OK);
    }
    bus_.advance_to(bus_.now_ns() + 10 * TimeNs{tick_ns});
    const std::uint32_t sync_id = sync({});
    bus_.advance_to(bus_.now_ns() + 10 * TimeNs{tick_ns});
    sync({0, 0, true, sync_id, 0, 0});
    bus_.advance_to(bus_.now_ns() + 10 * TimeNs{tick_ns});
    for (std::size_t i = 0; i < bus_.mcu_count(); ++i) {
      const std::uint8_t address = bus_.node(i).address();
      ASSERT_EQ(acknowledged(address, bushd_control{BUSHD_CONTROL_ENABLE, 0}), BUSHD_OK);
      ASSERT_EQ(poll(address).state, BUSHD_STATE_READY);
    }
  }

  // One SYNC that also tells where, by the first MCU's clock, the one before was.
  void discipline(std::uint8_t reference_address) {
    const bushd_report report = poll(reference_address);
    sync({0, 0, true, report.sync_id, report.sync_tick, report.sync_ns});
  }

  void upload_table(std::uint8_t address, std::uint8_t bank, std::uint32_t time_unit_ns,
                    const std::vector<std::uint16_t>& accel, std::uint16_t cruise) {
    const bushd_table_begin begin{
        bank, static_cast<std::uint16_t>(accel.size()), 0, cruise, time_unit_ns, 1};
    ASSERT_EQ(acknowledged(address, begin), BUSHD_OK);
    for (std::size_t at = 0; at < accel.size(); at += BUSHD_TABLE_DATA_MAX_CODES) {
      const auto count = static_cast<std::uint8_t>(
          std::min<std::size_t>(BUSHD_TABLE_DATA_MAX_CODES, accel.size() - at));
      const Bytes payload = payload_of([&](std::uint8_t* to) {
        return bushd_encode_table_data(bank, static_cast<std::uint16_t>(at), count,
                                       accel.data() + at, to);
      });
      ASSERT_EQ(acknowledged(address, BUSHD_MSG_TABLE_DATA, payload), BUSHD_OK);
    }
    bushd_table table{};
    table.accel.code = table.decel.code = accel.data();
    table.accel.count = table.decel.count = static_cast<std::uint16_t>(accel.size());
    table.cruise = cruise;
    table.time_unit_ns = time_unit_ns;
    const bushd_table_end end{bank, bushd_table_crc32(&table)};
    ASSERT_EQ(acknowledged(address, end), BUSHD_OK);
  }

  void assign(std::uint8_t address, std::uint8_t motor, std::uint8_t bank) {
    ASSERT_EQ(acknowledged(address, bushd_assign{motor, bank}), BUSHD_OK);
  }
  void assign_all(std::uint8_t address, std::uint8_t bank) {
    for (std::uint8_t m = 0; m < BUSHD_MOTORS_PER_MCU; ++m) {
      ASSERT_NO_FATAL_FAILURE(assign(address, m, bank));
    }
  }

  // Fine ticks for one motor, from first_tick on, at rest behind the last.
  void fine_ticks(std::uint8_t address, std::uint8_t motor, std::uint32_t first_tick,
                  const std::vector<std::int16_t>& displacements, std::uint16_t delay_at_end = 0) {
    send(address, BUSHD_MSG_TICKS,
         test::ticks_payload({.flags = BUSHD_TICKS_FINE | BUSHD_TICKS_START,
                              .first = first_tick,
                              .count = static_cast<std::uint8_t>(displacements.size()),
                              .mask = static_cast<std::uint16_t>(1u << motor),
                              .displacements = displacements,
                              .delays = {delay_at_end}}));
  }

  // For how long an MCU may be silent before it answers, if it does not announce its answers.
  TimeNs patience_ns = 0;
  std::vector<Frame> frames;
  int bad_frames = 0;

 private:
  template <class Message>
  Message answer(std::uint8_t address, bushd_type type,
                 bushd_status (*decode)(const std::uint8_t*, std::size_t, Message*)) {
    const auto reply = request(address, static_cast<std::uint8_t>(type));
    const auto told = reply ? decoded(reply->payload, decode) : std::nullopt;
    EXPECT_TRUE(told) << "no answer from " << int{address} << " to " << type;
    return told.value_or(Message{});
  }

  Bus& bus_;
  bushd_receiver receiver_{};
  std::uint8_t sequence_ = 0;
  std::uint32_t sync_id_ = 0;
  std::map<std::uint8_t, bushd_report> told_;
};

}  // namespace bushd::sim

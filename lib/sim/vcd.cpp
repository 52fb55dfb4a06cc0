#include "sim/vcd.h"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <charconv>
#include <system_error>

namespace bushd::sim {
namespace {

constexpr std::size_t kWiresPerMcu = 2 * kOutputsPerMcu + 5;
constexpr std::size_t kWindings = 4;
constexpr std::size_t kRealsPerMcu = kWindings + 1;  // and Sample::kSupply
constexpr std::size_t kTextBytes = std::size_t{1} << 18;

constexpr std::array<const char*, 5> kOthers = {"en", "common_dir", "position_compare", "trigger",
                                                "emergency"};

std::size_t wire_of(const Edge& edge) {
  const std::size_t first = edge.mcu * kWiresPerMcu;
  if (edge.signal == Signal::kStep) return first + edge.index;
  if (edge.signal == Signal::kDir) return first + kOutputsPerMcu + edge.index;
  static_assert(static_cast<std::size_t>(Signal::kEnable) == 2);
  return first + 2 * kOutputsPerMcu + static_cast<std::size_t>(edge.signal) - 2;
}

std::string wire_name(std::size_t wire) {
  if (wire < kOutputsPerMcu) return "step" + std::to_string(wire);
  if (wire < 2 * kOutputsPerMcu) return "dir" + std::to_string(wire - kOutputsPerMcu);
  return kOthers.at(wire - 2 * kOutputsPerMcu);
}

// The standard allows any printable characters; short codes keep the file small.
std::string identifier(std::size_t number) {
  constexpr char kFirst = '!';
  constexpr std::size_t kCount = '~' - kFirst + 1;
  std::string code;
  do {
    code += static_cast<char>(kFirst + number % kCount);
    number /= kCount;
  } while (number != 0);
  return code;
}

Error write_error(const std::string& path, const char* what, int error_number) {
  return {.message = std::string(what) + ": " + std::generic_category().message(error_number) +
                     "; give a path on a disk that has room and may be written",
          .file = path};
}

}  // namespace

Result<std::unique_ptr<VcdWriter>> VcdWriter::create(const std::string& path,
                                                     std::span<const std::uint8_t> addresses,
                                                     const std::set<std::uint8_t>& measured,
                                                     const std::string& comment,
                                                     const std::set<std::uint8_t>& supplied) {
  File file(std::fopen(path.c_str(), "we"));
  if (!file) return fail(write_error(path, "the trace cannot be created", errno));
  // Text is gathered here already; a second buffer would only delay the news of a full disk.
  std::setvbuf(file.get(), nullptr, _IONBF, 0);
  std::unique_ptr<VcdWriter> writer(new VcdWriter(path, std::move(file), addresses.size()));
  if (!comment.empty()) writer->text_ += "$comment " + comment + " $end\n";
  writer->write_head(addresses, measured, supplied);
  writer->flush_text();
  if (writer->error_) return fail(*writer->error_);
  return writer;
}

VcdWriter::VcdWriter(std::string path, File file, std::size_t mcus)
    : path_(std::move(path)), file_(std::move(file)) {
  for (std::size_t wire = 0; wire < mcus * kWiresPerMcu; ++wire) {
    identifiers_.push_back(identifier(wire));
  }
  reals_.resize(mcus * kRealsPerMcu);
  text_.reserve(kTextBytes + 64);
}

void VcdWriter::write_head(std::span<const std::uint8_t> addresses,
                           const std::set<std::uint8_t>& measured,
                           const std::set<std::uint8_t>& supplied) {
  std::size_t next = identifiers_.size();
  text_ += "$version bushd virtual bus $end\n$timescale 1 ns $end\n";
  for (std::size_t mcu = 0; mcu < addresses.size(); ++mcu) {
    text_ += "$scope module mcu" + std::to_string(addresses[mcu]) + " $end\n";
    for (std::size_t wire = 0; wire < kWiresPerMcu; ++wire) {
      text_ += "$var wire 1 " + identifiers_[mcu * kWiresPerMcu + wire] + " " + wire_name(wire) +
               " $end\n";
    }
    const auto name_real = [&](std::size_t index, const std::string& name) {
      std::string& code = reals_[mcu * kRealsPerMcu + index] = identifier(next++);
      text_ += "$var real 64 " + code + " " + name + " $end\n";
    };
    for (std::size_t w = 0; w < kWindings && measured.contains(addresses[mcu]); ++w) {
      name_real(w, "current" + std::to_string(w) + "_a");
    }
    if (supplied.contains(addresses[mcu])) name_real(Sample::kSupply, "supply");
    text_ += "$upscope $end\n";
  }
  text_ += "$enddefinitions $end\n";
  write_time(0);
  text_ += "$dumpvars\n";
  for (std::size_t wire = 0; wire < identifiers_.size(); ++wire) write_value(wire, false);
  for (const std::string& code : reals_) {
    if (!code.empty()) text_ += "r0 " + code + "\n";
  }
  text_ += "$end\n";
}

void VcdWriter::write_time(TimeNs time_ns) {
  assert(time_ns >= last_time_ns_);
  if (time_ns == last_time_ns_) return;
  last_time_ns_ = time_ns;
  char digits[24];
  const auto end = std::to_chars(std::begin(digits), std::end(digits), time_ns).ptr;
  text_ += '#';
  text_.append(digits, end);
  text_ += '\n';
}

void VcdWriter::write_value(std::size_t wire, bool level) {
  text_ += level ? '1' : '0';
  text_ += identifiers_[wire];
  text_ += '\n';
}

void VcdWriter::sample(const Sample& sample) {
  if (reals_[sample.mcu * kRealsPerMcu + sample.winding].empty()) return;
  // A sensor is read for a whole tick at once, which may have been written already.
  const TimeNs time_ns = std::max(sample.time_ns, last_time_ns_);
  pending_.push_back({{time_ns, sample.mcu, {}, sample.winding, false}, sample.value});
}

// To 0.1 mA.
void VcdWriter::write_real(const Change& change) {
  char digits[32];
  const auto end = std::to_chars(std::begin(digits), std::end(digits), *change.value,
                                 std::chars_format::fixed, 4)
                       .ptr;
  text_ += 'r';
  text_.append(digits, end);
  text_ += ' ';
  text_ += reals_[change.edge.mcu * kRealsPerMcu + change.edge.index];
  text_ += '\n';
}

void VcdWriter::write_pending(TimeNs until_ns) {
  const auto rest = std::stable_partition(
      pending_.begin(), pending_.end(), [&](const Change& c) { return c.edge.time_ns < until_ns; });
  // The order given is the order of each MCU; a stable sort by time and MCU keeps it.
  std::stable_sort(pending_.begin(), rest, [](const Change& a, const Change& b) {
    return a.edge.time_ns != b.edge.time_ns ? a.edge.time_ns < b.edge.time_ns
                                            : a.edge.mcu < b.edge.mcu;
  });
  for (auto change = pending_.begin(); change != rest; ++change) {
    write_time(change->edge.time_ns);
    if (change->value) {
      write_real(*change);
    } else {
      write_value(wire_of(change->edge), change->edge.level);
      ++edges_written_;
    }
    if (text_.size() >= kTextBytes) flush_text();
  }
  pending_.erase(pending_.begin(), rest);
}

void VcdWriter::settled(TimeNs until_ns) {
  if (!pending_.empty()) write_pending(until_ns);
}

void VcdWriter::flush_text() {
  if (!error_ && std::fwrite(text_.data(), 1, text_.size(), file_.get()) != text_.size()) {
    fail_with(errno);
  }
  text_.clear();
}

void VcdWriter::fail_with(int error_number) {
  if (!error_) error_ = write_error(path_, "the trace cannot be written", error_number);
}

Result<void> VcdWriter::close(TimeNs end_ns) {
  assert(file_);
  write_pending(end_ns + 1);
  write_time(end_ns);
  // Without it a reader knows that there is more to come, or that the program was killed.
  text_ += "$comment end of trace $end\n";
  flush_text();
  if (std::fclose(file_.release()) != 0) fail_with(errno);
  if (error_) return fail(*error_);
  return {};
}

}  // namespace bushd::sim

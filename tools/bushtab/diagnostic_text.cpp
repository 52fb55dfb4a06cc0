#include "diagnostic_text.h"

#include <fmt/format.h>

namespace bushtab {
namespace {

using bushd::tables::profiles::Diagnostic;
using bushd::tables::profiles::Severity;

std::string place(const Diagnostic& diagnostic) {
  if (diagnostic.side.empty()) return "";
  return diagnostic.index && diagnostic.side != "cruise"
             ? fmt::format("{}[{}]: ", diagnostic.side, *diagnostic.index)
             : diagnostic.side + ": ";
}

}  // namespace

std::string text_of(const Diagnostic& diagnostic) {
  return fmt::format("{}: {}: {}{}", diagnostic.severity == Severity::kError ? "error" : "warning",
                     diagnostic.rule, place(diagnostic), diagnostic.message);
}

}  // namespace bushtab

#include "finding_text.h"

#include <fmt/format.h>

namespace bushtab {
namespace {

using bushd::tables::profiles::Finding;
using bushd::tables::profiles::Severity;

std::string place(const Finding& finding) {
  if (finding.side.empty()) return "";
  return finding.index && finding.side != "cruise"
             ? fmt::format("{}[{}]: ", finding.side, *finding.index)
             : finding.side + ": ";
}

}  // namespace

std::string text_of(const Finding& finding) {
  return fmt::format("{}: {}: {}{}", finding.severity == Severity::kError ? "error" : "warning",
                     finding.rule, place(finding), finding.message);
}

}  // namespace bushtab

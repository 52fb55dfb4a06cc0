#include "engine/message_kinds.h"

namespace bushd::test {

Fields& Fields::add_list(const char* name, const uint8_t* data, size_t count, size_t width) {
  if (!with_text_) return *this;
  std::string list;
  for (size_t i = 0; i < count; ++i) {
    append(&list, parts({width == 1 ? data[i] : bushd_get_u16(data + 2 * i)}));
  }
  return add_text(name, list);
}

Fields& Fields::add_text(const char* name, const std::string& value) {
  text_ += std::string(" ") + name + "=" + value;
  return *this;
}

std::string parts(std::initializer_list<int64_t> values) {
  std::string text;
  for (const int64_t value : values) text += (text.empty() ? "" : "/") + std::to_string(value);
  return text;
}

void append(std::string* list, const std::string& element) {
  *list += (list->empty() ? "" : ":") + element;
}

const Kinds& message_kinds() {
  static const Kinds all = [] {
    Kinds kinds;
    for (auto some :
         {setup_kinds, motion_kinds, run_kinds, stream_kinds, report_kinds, program_kinds}) {
      kinds.merge(some());
    }
    return kinds;
  }();
  return all;
}

}  // namespace bushd::test

#include "cell_grid.h"

#include "utf8.h"

namespace bushtab {
namespace {

char32_t ascii_of(char32_t character) {
  if (character < 0x7F) return character;
  constexpr std::u32string_view kFrom = U"²│─└←→↑↓";
  constexpr std::u32string_view kTo = U"2|-+<>^v";
  const std::size_t known = kFrom.find(character);
  if (known != std::u32string_view::npos) return kTo[known];
  const bool braille = character > 0x2800 && character < 0x2900;
  return braille ? U'*' : U'?';
}

}  // namespace

void CellGrid::put(int row, int column, char32_t character, Style style) {
  if (row < 0 || row >= rows_ || column < 0 || column >= columns_) return;
  cells_[index(row, column)] = {unicode_ ? character : ascii_of(character), style};
}

int CellGrid::put_text(int row, int column, std::string_view utf8, Style style) {
  for (const char32_t character : from_utf8(utf8)) put(row, column++, character, style);
  return column;
}

}  // namespace bushtab

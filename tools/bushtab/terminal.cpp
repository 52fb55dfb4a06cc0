#include "terminal.h"

#include <langinfo.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/signalfd.h>
#include <termios.h>
#include <unistd.h>

// Its macros have names like erase and move.
#define NCURSES_NOMACROS
#include <curses.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <clocale>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <cwchar>
#include <optional>
#include <string>
#include <utility>

namespace bushtab {
namespace {

constexpr int kEscapeDelayMs = 50;  // a lone Esc is told from the beginning of a key's sequence
constexpr int kMaxColumns = 1000;
constexpr int kMaxRows = 500;

enum Pair : short { kCyan = 1, kYellow, kRed };

const char* environment(const char* name) {
  const char* value = std::getenv(name);
  return value != nullptr ? value : "";
}

// Without colours the difference is in the attributes alone.
attr_t attributes_of(Style style) {
  switch (style) {
    case Style::kTitle:
    case Style::kCursor:
      return A_REVERSE;
    case Style::kSelected:
      return A_BOLD | A_UNDERLINE;
    case Style::kFaint:
      return A_DIM;
    case Style::kKey:
    case Style::kError:
      return A_BOLD;
    default:
      return A_NORMAL;
  }
}

short pair_of(Style style) {
  switch (style) {
    case Style::kCurve:
      return kCyan;
    case Style::kSelected:
    case Style::kWarning:
      return kYellow;
    case Style::kError:
      return kRed;
    default:
      return 0;
  }
}

sigset_t signals_taken() {
  sigset_t set;
  sigemptyset(&set);
  for (const int number : {SIGINT, SIGTERM, SIGHUP, SIGQUIT, SIGWINCH}) sigaddset(&set, number);
  return set;
}

std::optional<Key> key_of_function(wint_t code) {
  constexpr std::array<std::pair<wint_t, Key>, 11> kKeys{{{KEY_LEFT, key::kLeft},
                                                          {KEY_RIGHT, key::kRight},
                                                          {KEY_UP, key::kUp},
                                                          {KEY_DOWN, key::kDown},
                                                          {KEY_PPAGE, key::kPageUp},
                                                          {KEY_NPAGE, key::kPageDown},
                                                          {KEY_HOME, key::kHome},
                                                          {KEY_END, key::kEnd},
                                                          {KEY_DC, key::kDelete},
                                                          {KEY_ENTER, key::kEnter},
                                                          {KEY_BACKSPACE, key::kBackspace}}};
  for (const auto& [function, key] : kKeys) {
    if (function == code) return key;
  }
  return std::nullopt;
}

}  // namespace

bool Terminal::is_there() {
  return isatty(STDIN_FILENO) == 1 && isatty(STDOUT_FILENO) == 1;
}

bushd::Result<std::unique_ptr<Terminal>> Terminal::open() {
  const std::string name = environment("TERM");
  std::setlocale(LC_CTYPE, "");
  const bool known = newterm(name.c_str(), stdout, stdin) != nullptr;
  if (!known || tigetstr("cup") == nullptr) {
    if (known) endwin();
    return bushd::fail("tui cannot draw on a terminal of type \"" + name +
                       "\"; set TERM to what yours is, often xterm");
  }
  return std::unique_ptr<Terminal>(new Terminal());
}

Terminal::Terminal() : unicode_(std::strcmp(nl_langinfo(CODESET), "UTF-8") == 0) {
  // Taken by a descriptor, so that nothing happens in between: ncurses would only be put out.
  const sigset_t set = signals_taken();
  sigprocmask(SIG_BLOCK, &set, nullptr);
  signals_ = signalfd(-1, &set, SFD_CLOEXEC | SFD_NONBLOCK);
  cbreak();
  noecho();
  nonl();
  // Ctrl-S is a key, and not what freezes the screen.
  termios settings{};
  if (tcgetattr(STDIN_FILENO, &settings) == 0) {
    settings.c_iflag &= ~static_cast<tcflag_t>(IXON);
    tcsetattr(STDIN_FILENO, TCSANOW, &settings);
    def_prog_mode();
  }
  keypad(stdscr, TRUE);
  nodelay(stdscr, TRUE);
  set_escdelay(kEscapeDelayMs);
  curs_set(0);
  coloured_ = has_colors() && *environment("NO_COLOR") == '\0' && start_color() == OK;
  if (coloured_) {
    use_default_colors();
    init_pair(kCyan, COLOR_CYAN, -1);
    init_pair(kYellow, COLOR_YELLOW, -1);
    init_pair(kRed, COLOR_RED, -1);
  }
}

Terminal::~Terminal() {
  endwin();
  close(signals_);
  // A program that is told to end is often told twice, by its shell and by the terminal. The second
  // time must not take the last words from it.
  if (gone_) return;
  const sigset_t set = signals_taken();
  sigprocmask(SIG_UNBLOCK, &set, nullptr);
}

Window Terminal::window() const {
  Window window{.unicode = unicode_};
  getmaxyx(stdscr, window.rows, window.columns);
  window.rows = std::max(window.rows, 1);
  window.columns = std::max(window.columns, 1);
  return window;
}

void Terminal::draw(const CellGrid& grid) {
  erase();
  for (int row = 0; row < grid.rows(); ++row) {
    for (int column = 0; column < grid.columns(); ++column) {
      const Cell& cell = grid.at(row, column);
      // A name may have characters of other widths: the columns must stay.
      auto character = static_cast<wchar_t>(cell.character);
      if (wcwidth(character) != 1) character = L'?';
      const wchar_t text[] = {character, L'\0'};
      cchar_t shown;
      setcchar(&shown, text, attributes_of(cell.style), coloured_ ? pair_of(cell.style) : short{0},
               nullptr);
      mvadd_wch(row, column, &shown);
    }
  }
  refresh();
}

void Terminal::take_keys() {
  wint_t code = 0;
  while (true) {
    const int kind = get_wch(&code);
    if (kind == ERR) return;
    if (kind == KEY_CODE_YES) {
      if (const auto key = key_of_function(code)) waiting_.push_back({Event::kKey, *key});
    } else if (code == L'\r') {
      waiting_.push_back({Event::kKey, key::kEnter});
    } else if (code == 0x7F) {
      waiting_.push_back({Event::kKey, key::kBackspace});
    } else if (code == 0x0C) {
      clearok(curscr, TRUE);  // Ctrl-L: somebody else has written on the screen
      waiting_.push_back({Event::kResized});
    } else {
      waiting_.push_back({Event::kKey, static_cast<Key>(code)});
    }
  }
}

Terminal::Input Terminal::take_signal() {
  signalfd_siginfo info{};
  if (read(signals_, &info, sizeof info) != sizeof info) return {Event::kResized};
  if (info.ssi_signo == SIGINT) return {Event::kInterrupted};
  if (info.ssi_signo != SIGWINCH) return {Event::kGone};
  winsize size{};
  if (ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_row > 0 && size.ws_col > 0) {
    resizeterm(std::min<int>(size.ws_row, kMaxRows), std::min<int>(size.ws_col, kMaxColumns));
  }
  return {Event::kResized};
}

Terminal::Input Terminal::wait() {
  const Input input = next();
  if (input.event == Event::kGone) gone_ = true;
  return input;
}

Terminal::Input Terminal::next() {
  while (waiting_.empty()) {
    std::array<pollfd, 2> sources{{{STDIN_FILENO, POLLIN, 0}, {signals_, POLLIN, 0}}};
    // Interrupted by being stopped and continued (Ctrl-Z): ncurses has drawn all again.
    if (poll(sources.data(), sources.size(), -1) < 0 && errno != EINTR) return {Event::kGone};
    if ((sources[1].revents & POLLIN) != 0) return take_signal();
    if (sources[0].revents != 0) {
      take_keys();
      if (waiting_.empty() && (sources[0].revents & (POLLHUP | POLLERR)) != 0) {
        return {Event::kGone};
      }
    }
  }
  const Input input = waiting_.front();
  waiting_.pop_front();
  return input;
}

}  // namespace bushtab

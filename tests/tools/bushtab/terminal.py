"""A program on a terminal of its own: a pty, and the screen that its output makes.

What is written is understood as a terminal of type xterm or vt100 does, as far as ncurses makes use of them.
"""

import codecs
import fcntl
import os
import pty
import re
import select
import signal
import struct
import termios
import time

PATIENCE_S = 30
SEQUENCE = re.compile(r"\x1b(?:\[([?>!]?)([0-9;]*)([@-~])|[()][A-Z0-9]|[=>78NMDE]|\][^\x07]*\x07)")
UNFINISHED = re.compile(r"\x1b(?:\[[?>!]?[0-9;]*|[()]|\][^\x07]*)?\Z")


class Screen:
    def __init__(self, rows, columns):
        self.cells = []
        self.row = self.column = 0
        self.last = " "
        self.resize(rows, columns)
        self.alternate = False  # between smcup and rmcup
        self.wraps = True
        self.seen_colour = False
        self.pending = ""

    def resize(self, rows, columns):
        """What fits stays."""
        self.rows, self.columns = rows, columns
        self.cells = [(row + [" "] * columns)[:columns] for row in self.cells[:rows]]
        self.cells += [[" "] * columns for _ in range(rows - len(self.cells))]
        self.row, self.column = min(self.row, rows - 1), min(self.column, columns - 1)
        self.top, self.bottom = 0, rows - 1

    def text(self):
        return "\n".join("".join(row).rstrip() for row in self.cells)

    def feed(self, text):
        self.pending += text
        while self.pending:
            sequence = SEQUENCE.match(self.pending)
            if sequence:
                self.pending = self.pending[sequence.end() :]
                if sequence[3]:
                    self.control(sequence[1], sequence[2], sequence[3])
                elif sequence[0] == "\x1bM":
                    self.up()
            elif UNFINISHED.match(self.pending):
                return
            else:
                self.character(self.pending[0])
                self.pending = self.pending[1:]

    def character(self, character):
        if character == "\r":
            self.column = 0
        elif character == "\n":
            self.down()
        elif character == "\b":
            self.column = max(self.column - 1, 0)
        elif character == "\t":
            self.column = min((self.column // 8 + 1) * 8, self.columns - 1)
        elif character >= " ":
            if self.column == self.columns and not self.wraps:
                self.column -= 1
            if self.column == self.columns:  # a wrap that was put off
                self.column = 0
                self.down()
            self.cells[self.row][self.column] = self.last = character
            self.column += 1

    def down(self):
        if self.row == self.bottom:
            del self.cells[self.top]
            self.cells.insert(self.bottom, [" "] * self.columns)
        else:
            self.row = min(self.row + 1, self.rows - 1)

    def up(self):
        if self.row == self.top:
            del self.cells[self.bottom]
            self.cells.insert(self.top, [" "] * self.columns)
        else:
            self.row = max(self.row - 1, 0)

    def control(self, private, text, final):
        numbers = [int(number) if number else 0 for number in text.split(";")]
        count = max(numbers[0], 1)
        if private:
            if numbers[0] == 1049:
                self.alternate = final == "h"
            if numbers[0] == 7:
                self.wraps = final == "h"
            return
        self.column = min(self.column, self.columns - 1)
        line = self.cells[self.row]
        if final in "Hf":
            self.row = min(count, self.rows) - 1
            self.column = min(max(numbers[1] if len(numbers) > 1 else 1, 1), self.columns) - 1
        elif final == "d":
            self.row = min(count, self.rows) - 1
        elif final == "G":
            self.column = min(count, self.columns) - 1
        elif final == "A":
            self.row = max(self.row - count, 0)
        elif final == "B":
            self.row = min(self.row + count, self.rows - 1)
        elif final == "C":
            self.column = min(self.column + count, self.columns - 1)
        elif final == "D":
            self.column = max(self.column - count, 0)
        elif final == "J":
            self.erase_display(numbers[0])
        elif final == "K":
            first, last = [(self.column, self.columns), (0, self.column + 1), (0, self.columns)][numbers[0]]
            line[first:last] = [" "] * (last - first)
        elif final == "X":
            last = min(self.column + count, self.columns)
            line[self.column : last] = [" "] * (last - self.column)
        elif final == "@":
            line[self.column : self.column] = [" "] * count
            del line[self.columns :]
        elif final == "P":
            del line[self.column : self.column + count]
            line.extend([" "] * (self.columns - len(line)))
        elif final == "b":
            for _ in range(count):
                self.character(self.last)
        elif final in "LM":
            for _ in range(count):
                at, away = (self.row, self.bottom) if final == "L" else (self.bottom, self.row)
                del self.cells[away]
                self.cells.insert(at, [" "] * self.columns)
        elif final in "ST":
            for _ in range(count):
                at, away = (self.bottom, self.top) if final == "S" else (self.top, self.bottom)
                del self.cells[away]
                self.cells.insert(at, [" "] * self.columns)
        elif final == "r":
            self.top = count - 1
            self.bottom = (numbers[1] if len(numbers) > 1 and numbers[1] else self.rows) - 1
            self.row = self.column = 0
        elif final == "m":
            self.seen_colour = self.seen_colour or any(30 <= number <= 37 for number in numbers)
        elif final not in "hlngct":
            raise AssertionError(f"a terminal's sequence that this screen does not know: {text}{final}")

    def erase_display(self, what):
        self.cells[self.row][self.column :] = [" "] * (self.columns - self.column)
        if what == 0:
            below = range(self.row + 1, self.rows)
        else:
            assert what == 2
            below = range(self.rows)
        for row in below:
            self.cells[row] = [" "] * self.columns


class Terminal:
    """Starts a program on a pty. __exit__ ends it if it has not ended by itself."""

    def __init__(self, command, rows=30, columns=100, **environment):
        self.screen = Screen(rows, columns)
        self.decoder = codecs.getincrementaldecoder("utf-8")("replace")
        self.raw = b""
        self.status = None
        self.pid, self.fd = pty.fork()
        if self.pid == 0:
            fcntl.ioctl(0, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
            os.execvpe(command[0], [str(word) for word in command], dict(os.environ, **environment))
        self.settings = termios.tcgetattr(self.fd)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        if self.status is None:
            os.kill(self.pid, signal.SIGKILL)
            os.waitpid(self.pid, 0)
        self.close()

    def close(self):
        """The terminal goes away, as a window does that is closed."""
        if self.fd is not None:
            os.close(self.fd)
        self.fd = None

    def read(self, until_s):
        """False at the end of the program's output."""
        if not select.select([self.fd], [], [], max(until_s - time.monotonic(), 0))[0]:
            raise TimeoutError(f"this did not come in {PATIENCE_S} s; the screen is\n{self.screen.text()}")
        try:
            data = os.read(self.fd, 65536)
        except OSError:  # the other end is closed
            return False
        self.raw += data
        self.screen.feed(self.decoder.decode(data))
        return bool(data)

    def wait(self, condition):
        """Reads until the condition, of the screen's text, holds."""
        until_s = time.monotonic() + PATIENCE_S
        while not condition(self.screen.text()):
            if not self.read(until_s):
                raise EOFError(f"the program ended; the screen is\n{self.screen.text()}")

    def wait_for(self, *texts):
        self.wait(lambda screen: all(text in screen for text in texts))

    def send(self, keys):
        os.write(self.fd, keys.encode())

    def resize(self, rows, columns):
        self.screen.resize(rows, columns)
        fcntl.ioctl(self.fd, termios.TIOCSWINSZ, struct.pack("HHHH", rows, columns, 0, 0))
        os.kill(self.pid, signal.SIGWINCH)

    def end(self):
        """Waits for the program's end; returns its exit code, or minus the signal that ended it."""
        until_s = time.monotonic() + PATIENCE_S
        while self.read(until_s):
            pass
        return self.wait_status()

    def wait_status(self):
        _, status = os.waitpid(self.pid, 0)
        self.status = os.waitstatus_to_exitcode(status)
        return self.status

"""Progress: a line drawn over where somebody watches, lines now and then where nobody does; streams that are closed."""

import io
import subprocess
import sys

from capture_plan.terminal import Terminal


class Screen(io.StringIO):
    def isatty(self):
        return True


def shown(stream, every_s, count=20):
    """What a terminal shows of `count` steps of so many seconds."""
    clock = iter(float(every_s * i) for i in range(9 * count))
    terminal = Terminal(stream, now=lambda: next(clock))
    for done in range(count + 1):
        terminal("Solving", done, count)
    return stream.getvalue()


def test_a_pipe_hears_of_long_work_now_and_then_and_how_long_it_takes():
    lines = shown(io.StringIO(), every_s=2).splitlines()
    assert lines[0] == "Solving: 15%, about 34 s left"
    assert len(lines) == 6
    assert "\r" not in "".join(lines)


def test_a_pipe_hears_nothing_of_short_work():
    assert shown(io.StringIO(), every_s=0.2) == ""


def test_a_line_that_somebody_watches_is_cleared_in_the_end():
    text = shown(Screen(), every_s=1)
    assert "50%  Solving, about 10 s left" in text
    assert text.endswith("\r")
    assert text.split("\r")[-2].strip() == ""


def test_it_says_how_far_work_got_that_is_stopped():
    terminal, screen = Terminal(io.StringIO()), Terminal(Screen())
    assert terminal.stopped() == "stopped"
    for one in (terminal, screen):
        one("Solving", 0, 8)
        one("Solving", 6, 8)
        assert one.stopped() == "stopped at 'Solving', 75% done"
    assert screen.stream.getvalue().split("\r")[-2].strip() == ""
    terminal("Solving", 8, 8)
    assert terminal.stopped() == "stopped after 'Solving'"


def test_no_file_gets_the_number_of_a_stream_that_is_closed(tmp_path):
    code = "from capture_plan.terminal import open_streams; open_streams(); import os; print(os.open('x', 65, 420) > 2)"
    command = ["sh", "-c", f'"{sys.executable}" -c "{code}" 2>&- <&-']
    assert subprocess.run(command, capture_output=True, text=True, cwd=tmp_path).stdout == "True\n"

"""A bar on a terminal, plain lines elsewhere."""

from palpate.adapters.cli.progress import progress


def test_without_a_terminal_there_is_a_line_at_every_tenth(capsys):
    with progress(30, "trial", "torque", initial=2) as bar:
        for number in range(28):
            bar.set_postfix_str(f"time {number} s")
            bar.update()
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == "torque: 3 of 30 trials, time 0 s"
    assert [int(line.split()[1]) for line in lines] == list(range(3, 31, 3))
    with progress(30, "log", passing=True) as bar:
        bar.update(30)
    assert capsys.readouterr().err == ""


def test_on_a_terminal_there_is_a_bar(capsys, monkeypatch):
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with progress(2, "trial") as bar:
        bar.update()
    assert "\r" in capsys.readouterr().err

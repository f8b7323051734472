"""Mutations of made-up functions, which tests guard a file, and what verdicts come of their runs."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, cast

import pytest

from benchmarks.mutants import core_mutants, gate, never_run
from benchmarks.mutants.functions import functions_in
from benchmarks.mutants.operators import places
from benchmarks.mutants.swapping import swapped
from benchmarks.mutants.trees import Ran, Tree
from benchmarks.mutants.verdicts import Judge


def variants(source: str) -> dict[str, list[str]]:
    """What each operator makes of the only function of a source: its body, all variants of all places."""
    (function,) = functions_in(source, "f.py")
    return {
        operator: [place.applied(source, n) for place in ones for n in range(len(place.variants))]
        for operator, ones in places(function.node).items()
    }


@pytest.mark.parametrize(
    ("body", "operator", "expected"),
    [
        ("return a < b", "comparison", ["return (a <= b)", "return (a >= b)"]),
        ("return a is b in c", "comparison", ["return (a is not b in c)", "return (a is b not in c)"]),
        ("return 2 * a", "arithmetic", ["return (2 / a)"]),
        ("a -= b", "arithmetic", ["a += b"]),
        ("return -a", "arithmetic", ["return (a)"]),
        ("return a[1]", "constant", ["return a[(2)]", "return a[(0)]"]),
        ("return a and not b", "boolean", ["return (a or not b)", "return a and (b)"]),
        ("f(True)", "boolean", ["f((False))"]),
        ("return [x for x in a if x]", "boolean", ["return [x for x in a if (not x)]"]),
        ("return a if b else c", "boolean", ["return a if (not b) else c"]),
        ("return a if b else c", "branches", ["return (c if b else a)"]),
        ("f(a)", "statement", ["pass"]),
        ("a: int = b", "statement", ["pass"]),
    ],
)
def test_operators(body: str, operator: str, expected: list[str]) -> None:
    head = "def f(a: int, b: 'x < 1') -> None:\n    "
    assert variants(head + body)[operator] == [head + one for one in expected]


class FakeTree:
    """Says what it is told to: with the mutation, then without it."""

    def __init__(self, *mutated_: Ran, plain: Ran | None = None) -> None:
        self.script, self.plain, self.inside = list(mutated_), plain or Ran(0, 1.0, "", ""), False
        self.left_out: list[str] = []

    @contextmanager
    def holding(self, file: str, source: str) -> Iterator[None]:
        self.inside = True
        yield
        self.inside = False

    def run(self, tests: Sequence[str], limit_s: float | None, left_out: Sequence[str] = ()) -> Ran:
        self.left_out = list(left_out)
        return self.script.pop(0) if self.inside else self.plain


PASSED, FAILED = Ran(0, 5.0, "", ""), Ran(1, 5.0, "t.py::test_a", "")
STAGES = [("room", ["r.py"]), ("golden", ["g.py"])]


@pytest.mark.parametrize(
    ("tree", "verdict", "stage"),
    [
        (FakeTree(PASSED, PASSED), "survived", ""),
        (FakeTree(PASSED, FAILED, FAILED), "killed", "golden"),
        (FakeTree(Ran(4, 1.0, "", "ImportError")), "killed", "room"),
        (FakeTree(Ran(2, 1.0, "t.py", "")), "killed", "room"),
        (FakeTree(Ran(None, 60.0, "", "")), "killed by timeout", "room"),
        (FakeTree(Ran(None, 60.0, "", ""), plain=Ran(0, 40.0, "", "")), "not killed in time", "room"),
        (FakeTree(Ran(0, 59.5, "", "")), "not killed in time", "room"),
        # Failing without the mutation, or not again with it, is no kill.
        (FakeTree(FAILED, FAILED, PASSED, PASSED, plain=FAILED), "survived", ""),
        (FakeTree(FAILED, PASSED, PASSED, PASSED), "survived", ""),
    ],
)
def test_verdicts(tree: FakeTree, verdict: str, stage: str) -> None:
    found = Judge(cast(Tree, tree), 60.0).verdict("f.py", "", STAGES)
    assert (found["verdict"], found["stage"]) == (verdict, stage)
    assert found["distrusted"] == tree.left_out
    assert tree.script == []


def test_tests_that_cannot_run_here_kill_nothing() -> None:
    broken = Ran(3, 1.0, "", "'flaky' not found in markers")
    with pytest.raises(SystemExit, match="without a mutation either:\n'flaky' not found"):
        Judge(cast(Tree, FakeTree(broken, plain=broken)), 60.0).verdict("f.py", "", STAGES)


def test_the_gate_leaves_out_what_no_trial_can_show() -> None:
    source = """
def f(a, b):
    accepted = "at most 9" if b else "9"
    if a > 9:
        accepted = accepted or "9"
        raise ConfigurationError("task.a", a, accepted)
    require_names("states", b)
    c = number("task.b", b, 0.5)
    for x, y in zip(a, b, strict=True):
        c += x
    return None
"""
    found = {(one.mutant.operator, one.mutant.was) for one in core_mutants._candidates("f.py", source, set(range(20)))}
    assert found == {("statement", "c = number('task.b', b, 0.5)"), ("arithmetic", "c += x"), ("statement", "c += x")}


def test_the_gate_leaves_out_constants_that_no_run_line_reads() -> None:
    source = "_A = 1\n_B = _A\n_C = 2\nD = 3\n\n\ndef f():\n    return _B\n\n\ndef g():\n    return _C\n"
    found = {one.mutant.was for one in core_mutants._candidates("f.py", source, {7, 8})}
    assert found == {"1", "3", "return _B"}


def test_a_condition_over_several_lines_is_run_where_it_begins(tmp_path: Path) -> None:
    file = f"{never_run.THOROUGH[0]}x.py"
    (tmp_path / file).parent.mkdir(parents=True)
    (tmp_path / file).write_text("def f(a):\n    if a:\n        b()\n    elif (\n        a > 9\n    ):\n        c()\n")
    assert never_run.unrun(tmp_path, {file: {1, 2, 3, 5}}) == {f"{file}:7 f: c()": ""}


def test_what_changes_in_one_function_leaves_the_mutants_of_others_drawn_as_they_were() -> None:
    functions = [f"def f{n}(a, b):\n    return a + {n} < b * {n}\n" for n in range(200)]

    def drawn(functions: list[str], seed: int = 3) -> dict[str, set[str]]:
        source, by_function = "".join(functions), dict[str, set[str]]()
        found = core_mutants._candidates("f.py", source, set(range(999)))
        for one in core_mutants.draw({"f.py": list(found)}, 12, seed):
            by_function.setdefault(one.mutant.function, set()).add(one.mutant.id)
        return by_function

    before = drawn(functions)
    assert 60 < sum(map(len, before.values())) < 140  # one in 12 of 1200 places
    assert drawn(functions, seed=4) != before
    changed = next(iter(before))
    functions[int(changed[1:])] = f"def {changed}(a, b):\n    c = a / b\n    return c * b - 5 if a else c >= 4\n"
    after = drawn(["import math\n\n\n", *reversed(functions)])
    assert {name: ids for name, ids in after.items() if name != changed} == {
        name: ids for name, ids in before.items() if name != changed
    }
    assert not after.get(changed, set()) & before[changed]


def test_a_file_of_few_places_has_a_mutant_drawn() -> None:
    found = list(core_mutants._candidates("f.py", "def f(a):\n    return a + 1\n", {1, 2}))
    assert len(core_mutants.draw({"f.py": found}, 10**9, 3)) == 1


def test_survivors_of_the_gate_are_told_but_for_those_with_a_reason() -> None:
    supervision = "core/palpate/core/supervision/watches.py"
    judged = [
        {"id": f"{n}", "file": file, "line": 3, "function": "f", "operator": "constant", "was": "1", "becomes": "2",
         "verdict": "survived" if n < 2 else "killed", "killed_by": ""}
        for n, file in enumerate([supervision, *["core/palpate/core/errors.py"] * 59])
    ]  # fmt: skip
    text, missed = gate.report(judged, {"1": "nobody reads it"}, {"core/x.py:7 f": ""})
    assert missed  # 98 % are killed, but one survives in the supervisor without a reason
    assert f"survived: 0 {supervision}:3" in text
    assert "shown equivalent: 1 core/palpate/core/errors.py:3 f (constant)" in text
    assert "because nobody reads it" in text
    assert "never run: core/x.py:7 f" in text
    assert not gate.report(judged, {"0": "same", "1": "same"}, {"core/x.py:7 f": "nobody calls it"})[1]
    assert gate.report(judged, {"0": "same", "1": "same", "2": "same"}, {})[1]  # a reason for one that was killed


def test_a_function_gets_the_code_of_another_text_and_a_default_is_left_to_an_import(tmp_path: Path) -> None:
    text = "class A:\n    def f(self, n=1):\n        return n + 1\n"
    path = tmp_path / "swapped_here.py"
    space: dict[str, Any] = {}
    exec(compile(text, str(path), "exec"), space)
    assert not swapped(str(path), "A.f", text.replace("n=1", "n=(2)"))
    assert swapped(str(path), "A.f", text.replace("n + 1", "n - 1"))
    assert space["A"]().f() == 0

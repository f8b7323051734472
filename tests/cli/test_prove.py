"""``palpate prove``: a claim about a policy, judged by trials that go on where they stopped."""

import json
from pathlib import Path

from tests.command_line import CommandLine, files_in

EASY = ("--policy", "omniscient", "--claim.success-percent", 15, "--jobs", 1, "--out", "proof")


def test_trials_prove_a_claim_or_do_not_and_the_worst_are_kept(palpate: CommandLine) -> None:
    told = palpate.succeed("prove", *EASY, "--trials", 2).splitlines()
    assert told[1] == "proved: 2 of 2 ended well (95 % interval 15.811 to 100.000 %)"
    # Of any task, not of holes alone.
    assert told[0].startswith("at least 15 % of trials succeed with a true peak of at most 30 N, at 95 %: 2 trials in")
    assert told[2].startswith("without success 0; success with a greater force 0; highest true peak")
    found = json.loads(Path("proof/proof.json").read_text())
    kept = {tuple(trial) for trials in found["kept"].values() for trial in trials}
    assert {path.name for path in Path("proof/kept/seed-0").glob("*.png")} == {f"trial-{k:05d}.png" for _, k in kept}
    assert "equal in every bit" in palpate.succeed("replay", "proof/kept", "--jobs", 1)
    # Made again, there is nothing to make, and nothing comes out otherwise.
    before = files_in(Path("proof/cells"))
    assert palpate.succeed("prove", *EASY, "--trials", 2).splitlines()[1:] == told[1:]
    assert files_in(Path("proof/cells")) == before
    # Trials with other settings are of another proof.
    assert "task.press_kgf" in palpate.refusal("prove", *EASY, "--trials", 2, "--task.press-kgf", 0.6)
    # The same trials do not prove another claim.
    done = palpate("prove", *EASY, "--trials", 2, "--claim.force-N", 0.5)
    assert done.code == 1
    assert "neither proved nor refuted: 0 of 2 ended well" in done.stdout
    assert len(json.loads(Path("proof/proof.json").read_text())["kept"]["failed"]) == 2


def test_a_claim_that_so_few_trials_cannot_show_is_refused(palpate: CommandLine) -> None:
    refused = palpate.refusal("prove", "--policy", "torque", "--claim.success-percent", 99.9, "--trials", 100)
    assert "trials = 100 is refused: at least 3688" in refused

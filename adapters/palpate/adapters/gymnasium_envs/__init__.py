"""Gymnasium environments over the same learning core as everything else here.

Importing this registers ``palpate/PegInsertion-v0`` and ``palpate/PegInsertion6Dof-v0``; nothing heavy is loaded before
one is made. ``gymnasium.make("palpate.adapters.gymnasium_envs:palpate/...")`` imports it by itself. Gymnasium 1.0 did
away with entry points by which a package could register without any import, so there is none.
"""

try:
    from gymnasium.envs.registration import register
except ModuleNotFoundError as error:
    raise ModuleNotFoundError("the environments need Gymnasium: pip install 'palpate[gymnasium]'") from error

PEG_INSERTION = "palpate/PegInsertion-v0"
PEG_INSERTION_6DOF = "palpate/PegInsertion6Dof-v0"

# The insertion's own time limit, 20 s, ends any trial before so many steps. The other one's limit is an argument: a
# wrapper's would only be in the way.
register(
    id=PEG_INSERTION,
    entry_point=f"{__name__}.peg_insertion:PegInsertionEnv",
    reward_threshold=-20.0,
    max_episode_steps=200,
)
register(
    id=PEG_INSERTION_6DOF,
    entry_point=f"{__name__}.peg_insertion:PegInsertionEnv",
    max_episode_steps=200,
    kwargs={"task": "insertion-6dof"},
)

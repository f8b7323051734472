"""Gymnasium environments with the same learning core as all other commands.

Importing this package registers ``palpate/PegInsertion-v0`` and ``palpate/PegInsertion6Dof-v0``; heavy imports wait
until an environment is created. ``gymnasium.make("palpate.adapters.gymnasium_envs:palpate/...")`` imports the package
itself. Gymnasium 1.0 removed the entry points for registration without an import.
"""

try:
    from gymnasium.envs.registration import register
except ModuleNotFoundError as error:
    raise ModuleNotFoundError("the environments need Gymnasium: pip install 'palpate[gymnasium]'") from error

PEG_INSERTION = "palpate/PegInsertion-v0"
PEG_INSERTION_6DOF = "palpate/PegInsertion6Dof-v0"

# The insertion's own time limit, 20 s, ends any trial before this number of steps. A longer time limit needs the
# argument max_episode_steps.
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

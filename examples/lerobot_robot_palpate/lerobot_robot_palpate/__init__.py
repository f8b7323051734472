"""A LeRobot robot that inserts pegs with palpate."""

from lerobot_robot_palpate.config_palpate import PalpateConfig
from lerobot_robot_palpate.robot import Palpate

__all__ = ["Palpate", "PalpateConfig"]
